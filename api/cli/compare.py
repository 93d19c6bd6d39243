"""``damper-rig compare``: compare models of any kind on measured runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from api.cli.fmu import FmuInput, FmuOutput, FmuSet, fmu_choice
from api.cli.places import to_file

__all__ = ["compare"]


def compare(
    models: Annotated[list[Path], typer.Argument(metavar="MODEL ...", help="Models of any kind: .json or .fmu.")],
    *,
    runs: Annotated[
        list[Path], typer.Option("--runs", metavar="RUN.h5 ...", help="Measured runs of one specimen; can be repeated.")
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", callback=to_file, metavar="FILE.html", help="One page that opens offline.")
    ],
    fmu_input: FmuInput = None,
    fmu_output: FmuOutput = "",
    fmu_set: FmuSet = None,
    rate: Annotated[
        float | None, typer.Option("--rate", metavar="HZ", help="Resample all runs to this rate first.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the comparison as JSON, SI units.")] = False,
) -> None:
    """Compare models on measured runs: error, cost per sample, parameters, samples outside the training range.

    Example: damper-rig compare fitted.json other.json damper.fmu --runs runs/*.h5 -o comparison.html
    """
    from api.cli.terminal import answer, progress_bar, warn
    from api.errors import InputError
    from identification.blackbox import resampled
    from identification.measured import read_runs
    from identification.models import KINDS, comparison_data, comparison_text, load_model
    from identification.models import compare as compared
    from identification.models.comparison_page import write_comparison
    from identification.multiaxis import MAIN_FORCE

    if output.suffix != ".html":
        raise InputError(f"{output}: the comparison is a web page: end its name in .html")
    choice = fmu_choice(models, fmu_input, fmu_output, fmu_set)
    loaded = [load_model(path, choice, kinds=(*KINDS, MAIN_FORCE)) for path in models]
    measured = [one if rate is None else resampled(one, rate) for one in read_runs(runs)]
    with progress_bar("comparing") as tell:
        found = compared(loaded, measured, labels=_labels(models), on_progress=tell)
    warn(measured)  # only now: a refusal is one line
    write_comparison(output, found)
    answer(f"{comparison_text(found)}\n{output}", comparison_data(found) | {"file": str(output)}, as_json=as_json)


def _labels(paths: list[Path]) -> list[str]:
    """Names of the files; with their folders where two have the same name."""
    names = [path.name for path in paths]
    return [path.name if names.count(path.name) == 1 else str(path) for path in paths]
