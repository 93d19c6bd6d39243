"""``damper-rig import``: run files from the files of other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rigctl.foreign_files import Choice, Mapping

__all__ = ["import_files"]

_COLUMN = "COLUMN[:UNIT]"


def import_files(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE ...",
            help="CSV, TXT, XLSX, MAT, RPC III, UFF 58, MDF 4, TDMS, Parquet; folders with --mapping.",
        ),
    ],
    *,
    output: Annotated[
        Path,
        typer.Option(
            "-o", "--output", metavar="RUN.h5", help="The run file; for several a folder, or NAME.h5 for NAME-01.h5 …"
        ),
    ],
    time: Annotated[str, typer.Option(metavar=_COLUMN, help="Column of the time; none: take none, give --rate.")] = "",
    displacement: Annotated[str, typer.Option(metavar=_COLUMN, help="Column of the displacement.")] = "",
    velocity: Annotated[str, typer.Option(metavar=_COLUMN, help="Column of the velocity.")] = "",
    force: Annotated[str, typer.Option(metavar=_COLUMN, help="Column of the force.")] = "",
    current: Annotated[str, typer.Option(metavar=_COLUMN, help="Column of the control current.")] = "",
    temperature: Annotated[str, typer.Option(metavar=_COLUMN, help="Column of the temperature.")] = "",
    acceleration: Annotated[str, typer.Option(metavar=_COLUMN, help="Column of the acceleration.")] = "",
    axis: Annotated[
        list[str] | None,
        typer.Option(
            metavar=f"CHANNEL={_COLUMN}",
            help="Column of a further axis, such as displacement_y=Y:mm or torque_x=Mx:kN·m; can be repeated.",
        ),
    ] = None,
    flip: Annotated[list[str] | None, typer.Option(metavar="CHANNEL", help="Turn its sign; can be repeated.")] = None,
    centre: Annotated[
        list[str] | None, typer.Option(metavar="CHANNEL", help="Take its mean off; can be repeated.")
    ] = None,
    rate: Annotated[float | None, typer.Option(metavar="HZ", help="Sample rate, where no column has the time.")] = None,
    resample: Annotated[
        float | None, typer.Option(metavar="HZ", help="Interpolate samples at uneven times to this rate.")
    ] = None,
    part: Annotated[
        str, typer.Option("--part", "--sheet", metavar="NAME", help="Sheet, group or structure; all: every one.")
    ] = "",
    encoding: Annotated[str, typer.Option(help="Encoding of a text file, such as utf-8 or cp1252.")] = "",
    delimiter: Annotated[str, typer.Option(help="tab, semicolon, comma, bar or spaces.")] = "",
    decimal: Annotated[str, typer.Option(help="point or comma.")] = "",
    header_lines: Annotated[int | None, typer.Option(metavar="N", help="Lines before the first line of data.")] = None,
    specimen: Annotated[str, typer.Option(help="Specimen, for the run file.")] = "",
    kind: Annotated[
        str, typer.Option(help="Kind of excitation: multisine, sine, triangle, steps, sweep, road or custom.")
    ] = "",
    split: Annotated[bool, typer.Option("--split", help="Cut into a run for each level or frequency.")] = False,
    like: Annotated[Path | None, typer.Option(metavar="FIRST.h5", help="Choose as for this imported run.")] = None,
    mapping: Annotated[
        Path | None, typer.Option(metavar="LAB.toml", help="What holds for the files of an archive.")
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Show what would be taken; write nothing.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was taken as JSON.")] = False,
) -> None:
    """Make run files from the files of other programs: what is not stated is guessed, shown and checked.

    Example: damper-rig import dyno.csv -o run.h5 --displacement Stroke:mm --force Load:kN --flip force
    """
    from api.cli.import_archive import import_all
    from api.cli.terminal import answer
    from rigctl.foreign_files import Choice, column_choice

    columns = {
        "time": time,
        "displacement": displacement,
        "velocity": velocity,
        "force": force,
        "current": current,
        "temperature": temperature,
        "acceleration": acceleration,
    }
    stated = Choice(
        columns={name: column_choice(text) for name, text in (columns | _axes(axis or ())).items() if text},
        flip=tuple(flip or ()),
        centre=tuple(centre or ()),
        rate_hz=rate,
        resample_hz=resample,
        part=part,
        encoding=encoding or None,
        delimiter=delimiter or None,
        decimal=decimal or None,
        header_lines=header_lines,
        specimen=specimen,
        kind=kind,
    )
    found = import_all(files, output, _rules(stated, like, mapping, split=split), write=not dry_run)
    answer(found.text(), found.as_json(), as_json=as_json)
    if found.refused:
        raise typer.Exit(2)


def _axes(stated: Sequence[str]) -> dict[str, str]:
    """Columns of further axes by their channels."""
    from api.errors import InputError
    from rigctl.further_axes import FURTHER_AXES

    found = {}
    for one in stated:
        channel, equals, column = one.partition("=")
        if not equals or not column.strip() or channel not in FURTHER_AXES:
            raise InputError(
                f"--axis {one!r:.60}: write CHANNEL=COLUMN[:UNIT], CHANNEL one of {', '.join(FURTHER_AXES)}"
            )
        found[channel] = column
    return found


def _rules(stated: Choice, like: Path | None, mapping: Path | None, *, split: bool) -> Mapping:
    """What holds for the files: as for an earlier run, then by the mapping file, then as stated here."""
    from rigctl.foreign_files import Choice, Mapping, Rule, read_mapping

    first = Rule(match="*", choice=Choice() if like is None else _choice_of(like))
    last = Rule(match="*", choice=stated, split=split)
    return Mapping(rules=(first, *(() if mapping is None else read_mapping(mapping).rules), last))


def _choice_of(path: Path) -> Choice:
    from api.errors import InputError
    from rigctl.foreign_files import choice_from
    from rigctl.runfile import read_run

    imported = read_run(path).imported
    if imported is None:
        raise InputError(f"{path}: it does not say what was chosen: --like takes a run that 'damper-rig import' made")
    return choice_from(imported.get("choice"), f"{path}: attribute imported")
