"""Measured runs as every command and job takes them: read, and refused together where they cannot be right."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from hashlib import sha256
from pathlib import Path

from identification.errors import DataError
from rigctl.further_axes import FURTHER_AXES
from rigctl.magnitudes import doubts_of
from rigctl.runfile import Run, read_run

__all__ = ["check_runs", "label_of", "read_runs"]


def read_runs(paths: Iterable[Path], *, once: bool = False) -> list[Run]:
    """The runs in these files; `once`: each measurement counts, so none may be given twice.

    Raises
    ------
    RunFileError
        Where a file is no run file.
    DataError
        One line, where a run holds what no machine does, or where two hold the same measurement.
    """
    runs = [read_run(path) for path in paths]
    check_runs(runs, once=once)
    return runs


def check_runs(runs: Sequence[Run], *, once: bool = False) -> None:
    """Raise DataError, one line, where a run holds what no machine does, or, with `once`, where two are the same."""
    for run in runs:
        for doubt in doubts_of(run):
            if doubt.impossible:
                raise DataError(f"{label_of(run)}: {doubt.channel}: {doubt.text}")
    if once:
        _refuse_doubled(runs)


def _refuse_doubled(runs: Sequence[Run]) -> None:
    seen: dict[bytes, str] = {}
    for run in runs:
        mark = _mark(run)
        if mark in seen:
            raise DataError(
                f"{label_of(run)} holds the same measurement as {seen[mark]}: given twice, it counts twice; "
                "leave one out"
            )
        seen[mark] = label_of(run)


def _mark(run: Run) -> bytes:
    """The same for runs with the same motions and forces, sample by sample."""
    found = sha256(repr(run.sample_rate_hz).encode())
    for name in ("displacement", "force", *FURTHER_AXES):
        if name in run.channels:
            found.update(run.channels[name].tobytes())
    return found.digest()


def label_of(run: Run) -> str:
    """The name of a run for messages: of its file, else its id."""
    return run.path.name if run.path is not None else run.run_id
