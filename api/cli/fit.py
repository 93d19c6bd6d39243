"""``damper-rig fit``: the free parameters of a physical model from measured runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from identification.fitting import Fit

__all__ = ["fit"]


def fit(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="The model as it is known today.")],
    runs: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Measured runs of one specimen.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="MODEL.json", help="The fitted model.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print the parameters as JSON.")] = False,
) -> None:
    """Fit the free parameters of a physical model to runs.

    Example: damper-rig fit model.json runs/*.h5 -o fitted.json
    """
    from api.cli.terminal import answer, progress_bar, warn
    from identification.fitting import fit as fit_model
    from identification.physical.modelfile import read_model, write_model
    from rigctl.runfile import read_run

    start = read_model(model)
    measured = [read_run(path) for path in runs]
    warn(measured)
    with progress_bar("fitting") as tell:
        result = fit_model(start, measured, on_step=lambda step, cost: tell(1 - 0.8**step, f"fitting, step {step}"))
    write_model(output, result.model)
    answer(_text(output, result), _figures(output, result), as_json=as_json)


def _figures(output: Path, result: Fit) -> dict[str, Any]:
    return {
        "file": str(output),
        "gap": {"value": result.rms, "unit": "N"},
        "converged": result.converged,
        "reason": result.reason,
        "iterations": result.iterations,
        "parameters": {
            f"{element.name}.{element.spec.parameters[k].name}": {
                "value": element.parameters[k].value,
                "std": element.parameters[k].std,
                "unit": element.spec.parameters[k].unit,
                "fixed": element.parameters[k].fixed,
            }
            for element, k in result.model.slots()
        },
    }


def _text(output: Path, result: Fit) -> str:
    lines = [f"{output}: gap {result.rms:.4g} N rms after {result.iterations} iterations"]
    if not result.converged:
        lines[0] += f", not converged: {result.reason}"
    for name, entry in _figures(output, result)["parameters"].items():
        spread = "fixed" if entry["fixed"] else "" if entry["std"] is None else f"± {entry['std']:.2g}"
        lines.append(f"  {name:<36} {entry['value']:>12.5g} {entry['unit']:<10} {spread}".rstrip())
    return "\n".join(lines)
