"""``damper-rig fit``: the free parameters of a physical model from measured runs."""

from __future__ import annotations

import os
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from identification.fitting import Fit

__all__ = ["fit"]


def fit(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="The model with start values.")],
    runs: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Measured runs of one specimen.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="MODEL.json", help="The fitted model.")],
    starts: Annotated[int, typer.Option("--starts", help="Number of starts; the best fit is kept.")] = 1,
    robust: Annotated[
        float | None,
        typer.Option("--robust", help="Huber threshold, in noise standard deviations."),
    ] = None,
    refine: Annotated[
        bool, typer.Option("--refine", help="Fit smooth forms of friction and hysteresis where the runs show them.")
    ] = False,
    profiled: Annotated[
        list[str] | None,
        typer.Option(
            "--profile",
            metavar="ELEMENT.PARAMETER",
            help="Parameter whose interval is computed by profile likelihood; can be repeated.",
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the parameters as JSON.")] = False,
) -> None:
    """Fit the free parameters of a physical model to runs.

    Example: damper-rig fit model.json runs/*.h5 -o fitted.json
    """
    from api.cli.terminal import answer, ask, progress_bar, warn
    from identification.compute import chosen
    from identification.fitting import fit as fit_model
    from identification.fitting import moved_far, profile
    from identification.measured import read_runs
    from identification.physical.modelfile import read_model, write_model
    from identification.record import record_from_run

    start = read_model(model)
    measured = read_runs(runs, once=True)
    warn(measured)
    with chosen(os.environ), progress_bar("fitting") as tell:
        result = fit_model(
            start,
            measured,
            starts=starts,
            robust=robust,
            refine=refine,
            on_step=lambda step, cost: tell(1 - 0.8**step, f"fitting, step {step}"),
        )
        records = [record_from_run(run) for run in measured] if profiled else []
        intervals = {name: profile(result, records, name, robust=robust).interval for name in profiled or []}
    write_model(output, result.model)
    ask(moved_far(start, result.model))
    answer(_text(output, result, intervals), _figures(output, result, intervals), as_json=as_json)


Intervals = Mapping[str, tuple[float, float]]


def _figures(output: Path, result: Fit, intervals: Intervals) -> dict[str, Any]:
    from identification.fitting import warnings

    return {
        "file": str(output),
        "gap": {"value": result.rms, "unit": "N"},
        "converged": result.converged,
        "reason": result.reason,
        "iterations": result.iterations,
        "warnings": warnings(result),
        "intervals": {name: [e if isfinite(e) else None for e in ends] for name, ends in intervals.items()},
        "parameters": {
            f"{element.id}.{element.spec.parameters[k].name}": {
                "value": element.parameters[k].value,
                "std": element.parameters[k].std,
                "unit": element.spec.parameters[k].unit,
                "fixed": element.parameters[k].fixed,
            }
            for element, k in result.model.slots()
        },
    }


def _text(output: Path, result: Fit, intervals: Intervals) -> str:
    figures = _figures(output, result, intervals)
    lines = [f"{output}: gap {result.rms:.4g} N rms after {result.iterations} iterations"]
    if not result.converged:
        lines[0] += f", not converged: {result.reason}"
    for name, entry in figures["parameters"].items():
        spread = "fixed" if entry["fixed"] else "" if entry["std"] is None else f"± {entry['std']:.2g}"
        lines.append(f"  {name:<36} {entry['value']:>12.5g} {entry['unit']:<10} {spread}".rstrip())
    lines += [f"  {name}: 68 % within {low:.5g} … {high:.5g}" for name, (low, high) in intervals.items()]
    return "\n".join([*lines, *(f"  {sentence}" for sentence in figures["warnings"])])
