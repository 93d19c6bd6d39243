"""``damper-rig study range``: stroke and velocity of the service, of the training of a model, and of a rig."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from api.cli.options import AsJson
from api.cli.study_vehicle import Page

__all__ = ["range_"]


def range_(
    service: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Runs of the service.")],
    *,
    output: Page,
    model: Annotated[Path | None, typer.Option(metavar="MODEL.json", help="Its stated training range.")] = None,
    trained: Annotated[
        list[Path] | None,
        typer.Option(
            "--trained", metavar="RUN.h5 ...", help="The runs that the model was trained on; can be repeated."
        ),
    ] = None,
    envelope: Annotated[Path | None, typer.Option(metavar="RIG.toml", help="What the rig can do.")] = None,
    as_json: AsJson = False,
) -> None:
    """The stroke–velocity chart: does the training contain the service, and the rig both?

    Example: damper-rig study range service.h5 --trained runs/*.h5 --envelope rig.toml -o range.html
    """
    from api.cli.terminal import answer, warn
    from api.errors import InputError
    from excitation import read_envelope
    from identification.measured import read_runs
    from identification.models import load_model
    from identification.studies.range_page import write_range
    from identification.studies.service_range import range_data, range_text, service_range

    if output.suffix != ".html":
        raise InputError(f"{output}: the chart is a web page: end its name in .html")
    limits, known = read_envelope(envelope) if envelope else None, load_model(model) if model else None
    driven, learned = read_runs(service), read_runs(trained) if trained else []
    name = service[0].name if len(service) == 1 else ""
    found = service_range(driven, learned, model=known, envelope=limits, name=name)
    warn([*driven, *learned])  # only now: a refusal is one line
    write_range(output, found)
    answer(f"{range_text(found)}\n{output}", range_data(found) | {"file": str(output)}, as_json=as_json)
