"""What ``damper-rig import`` took from a file: one readable table, or JSON."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from rigctl.foreign_files import Imported

__all__ = ["SIGNS", "run_figures", "shown"]

SIGNS: Final = "positive displacement is extension (rebound), positive force is tension"
_HEADS: Final = ("channel", "column", "unit", "found by", "lowest", "highest", "")


def shown(runs: Sequence[tuple[Path, Imported]]) -> str:
    """The columns of the first run, and a line for each run."""
    first = runs[0][1]
    si = {name: unit for _, one in runs for name, unit in one.run.units.items()} | {"time": "s"}
    rows = [
        _HEADS,
        *(
            (c.channel, c.column[:40], c.unit, c.why, f"{c.low:.4g}", f"{c.high:.4g}", si[c.channel])
            for c in first.columns
        ),
    ]
    widths = [max(len(row[k]) for row in rows) for k in range(len(_HEADS))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return "\n".join([first.layout, *lines, f"signs as taken: {SIGNS}", *(_run_line(path, one) for path, one in runs)])


def _run_line(path: Path, one: Imported) -> str:
    run = one.run
    name = f" ({run.test_id})" if run.test_id else ""
    status = "" if run.status == "complete" else f", {run.status}"
    length = f"{run.samples} samples at {run.sample_rate_hz:.6g} Hz, {run.samples / run.sample_rate_hz:.4g} s"
    return f"{path}: {length}, {run.excitation_kind}{status}{name}"


def run_figures(path: Path, one: Imported) -> dict[str, Any]:
    """One run as JSON, SI units."""
    run = one.run
    return {
        "file": str(path),
        "samples": run.samples,
        "sample_rate": run.sample_rate_hz,
        "excitation_kind": run.excitation_kind,
        "status": run.status,
        "test_id": run.test_id,
        "layout": one.layout,
        "columns": [
            {
                "channel": c.channel,
                "column": c.column,
                "unit": c.unit,
                "found_by": c.why,
                "lowest": c.low,
                "highest": c.high,
            }
            for c in one.columns
        ],
        "choice": one.choice.as_json(),
        "told": list(one.told),
    }
