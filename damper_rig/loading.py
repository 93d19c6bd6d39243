"""Runs from files: run files of this project, and every format that `damper-rig import` reads."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from damper_rig.progress import progress
from damper_rig.runs import Runs
from damper_rig.words import in_python, said_in_python
from identification.datachecks import check_run, findings_of_import
from identification.measured import read_runs
from identification.models.simulation import name_of
from rigctl.foreign_files import Choice, Imported, column_choice, import_file
from rigctl.runfile import Run

__all__ = ["DataWarning", "chosen_of", "load", "taken"]

Taken = tuple[Run, tuple[str, ...]]  # and what there is to tell of it

_RUN_FILES: Final = (".h5", ".hdf5")


class DataWarning(UserWarning):
    """What an import took without being told, and what the data checks found in a run."""


def load(
    *files: str | os.PathLike[str],
    columns: Mapping[str, str] | None = None,
    flip: Sequence[str] = (),
    split: bool = False,
    choice: Choice | None = None,
) -> Runs:
    """The runs in these files; whatever is found odd in them is a DataWarning.

    ``columns``, ``flip`` and ``split`` are the options of `damper-rig import` for files of other programs:
    ``columns={"displacement": "Stroke:mm", "force": "Load:kN"}``, ``flip=["force"]``; ``split`` makes a run of each
    level of a sweep. ``choice`` holds all others, and is what these are added to.

    Raises
    ------
    RunFileError, DataError
        Where a run file cannot be used.
    ForeignFileError
        Where a file of another program cannot be read: what is missing or wrong, where, and what would be right.
    """
    found: list[Taken] = []
    with said_in_python(), progress("reading") as tell:
        chosen = chosen_of(columns, flip, choice)
        for k, path in enumerate(map(Path, files)):
            tell(k / len(files), f"reading {path.name}")
            found += _run_file(path) if path.suffix.lower() in _RUN_FILES else _foreign(path, chosen, split)
    for run, notes in found:
        for note in notes:
            warnings.warn(f"{name_of(run)}: {note}", DataWarning, stacklevel=2)
    return Runs(tuple(run for run, _ in found))


def chosen_of(columns: Mapping[str, str] | None, flip: Sequence[str], choice: Choice | None) -> Choice:
    """The choice with the columns and signs that are stated beside it; raises ForeignFileError."""
    given = Choice() if choice is None else choice
    stated = {name: column_choice(text) for name, text in (columns or {}).items()}
    return replace(given, columns={**given.columns, **stated}, flip=(*given.flip, *flip))


def taken(imported: Imported) -> Taken:
    """The run of an import, and what there is to tell of it."""
    return imported.run, (*map(in_python, imported.told), *map(str, findings_of_import(imported.run)))


def _run_file(path: Path) -> list[Taken]:
    return [(run, tuple(map(str, check_run(run)))) for run in read_runs([path])]


def _foreign(path: Path, choice: Choice, split: bool) -> Iterator[Taken]:
    """The runs of a foreign file, with the names that `damper-rig import` gives them."""
    found = import_file(path, choice, split=split)
    for k, one in enumerate(found, start=1):
        name = path.stem if len(found) == 1 else f"{path.stem}-{k:02d}"
        run, notes = taken(one)
        yield replace(run, path=path.with_name(f"{name}.h5")), notes
