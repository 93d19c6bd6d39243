"""A report in a few lines of text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

__all__ = ["report_lines"]


def report_lines(report: Mapping[str, Any]) -> list[str]:
    """The verdict, the names, the gap on held-out runs, the parts of the force before any model and the next test.

    A line each. Any: the JSON of the report.
    """
    gap = report["gap"]["held_out"]
    lines = [f"verdict: {report['verdict'].replace('_', ' ')}"]
    for effect in report["effects"]:
        values = ", ".join(f"{n} = {p['value']:.4g} {p['unit']}".rstrip() for n, p in effect["parameters"].items())
        lines.append(
            f"missing: {effect['element']} on the {effect['path']} path, "
            f"confidence {effect['confidence']:.2f} ({values})"
        )
    lines.append(
        f"held-out gap: {gap['as_given']:.4g} N as given, {gap['base_refitted']:.4g} N refitted, "
        f"{gap['final']:.4g} N explained, noise floor {gap['noise_floor']:.4g} N"
    )
    if (distortion := report.get("distortion")) is not None:
        lines.append(distortion["text"])
    if report["next_test"]["text"]:
        lines.append(f"next test: {report['next_test']['text']}")
    return lines
