"""Where a command writes: tried before it reads, computes or moves anything, so that no work is lost at its end."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

import typer

__all__ = ["check_file", "check_folder", "part_of", "spare_runs", "to_file", "to_file_here", "to_folder"]


def to_file(context: typer.Context, place: Path | None) -> Path | None:
    """Callback of an option that names a file to write; its folder must exist."""
    if place is not None and not context.resilient_parsing:  # completion writes nothing
        check_file(place)
    return place


def to_file_here(context: typer.Context, place: Path | None) -> Path | None:
    """As ``to_file``; where no file is named, the working folder takes one."""
    if place is None and not context.resilient_parsing:
        check_folder(Path())
    return to_file(context, place)


def to_folder(context: typer.Context, place: Path | None) -> Path | None:
    """Callback of an option that names a folder to write into; it is made where it does not exist."""
    if place is not None and not context.resilient_parsing:
        check_folder(place)
    return place


def check_file(place: Path) -> None:
    """Raise InputError where no file of this name can be written."""
    with _refusing(place):
        if place.is_dir():
            _refuse(place, "is a folder: give the name of a file in it")
        if place.exists() and not place.is_file():
            _refuse(place, "is a device or a pipe: give the name of a file")  # a rename would take its place
        if not place.parent.exists():
            _refuse(place, f"there is no folder {place.parent}: make it first")
        if not place.parent.is_dir():
            _refuse(place, f"{place.parent} is a file, not a folder: give another place")
        _try(place)


def spare_runs(output: Path, runs: Sequence[Path]) -> None:
    """Raise InputError where a model would be written over one of the runs that it is made of."""
    if output.exists() and any(run.exists() and run.samefile(output) for run in runs):
        _refuse(output, "is a run that this command reads: give another place")


def check_folder(place: Path, file: str = "run") -> None:
    """Raise InputError where no file of this name can be written into this folder, which need not exist yet."""
    with _refusing(place):
        missing = [one for one in (place, *place.parents) if not one.exists()]
        there = missing[-1].parent if missing else place
        if not there.is_dir():
            where = "" if there == place else f"{there} "
            _refuse(place, f"{where}is a file, not a folder: give another place")
        made: list[Path] = []
        try:
            for folder in reversed(missing):
                if not folder.exists():  # a/.. does, as soon as a does
                    folder.mkdir()
                    made.append(folder)
            _try(place / file)
        finally:
            for folder in reversed(made):
                folder.rmdir()


def _try(place: Path) -> None:
    """Make an empty file beside the place, under the name that it has until it is whole, and remove it.

    Only that is certain: what `os.access` answers is not so for root, nor on every file system.
    """
    temporary = place.with_name(f".{place.name}.{os.getpid()}.try")
    with temporary.open("xb"):
        pass
    temporary.unlink()


@contextmanager
def _refusing(place: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        _refuse(place, f"cannot be written ({error.strerror or error}): give another place", error)


def _refuse(place: Path, why: str, because: Exception | None = None) -> NoReturn:
    from api.errors import InputError

    raise InputError(f"{place!s:.200}: {why}") from because


def part_of(output: Path) -> Path:
    """Where a study keeps what it has done until its page is written."""
    return output.with_name(f"{output.name}.part")
