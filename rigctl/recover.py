"""Closes run files that a crash left open, with every sample that was on the disk."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

from excitation.atomic import sync_directory
from excitation.untrusted import DAMAGE, open_hdf5
from rigctl.disk_reserve import DiskReserve, whole_blocks
from rigctl.errors import RunFileError
from rigctl.runfile import read_channel, read_run, run_from_attributes, write_run
from rigctl.runwriter import PART_SUFFIX, lock_part


@dataclass(frozen=True, slots=True, kw_only=True)
class Recovered:
    """The result for one orphan: its file, or why it could not be closed."""

    orphan: Path
    path: Path | None
    samples: int
    reason: str = ""


def recover(path: str | os.PathLike[str]) -> Path:
    """Close one orphan (``….h5.part``) as ``truncated`` under its own name and return that name.

    The orphan is removed after the copy is on the disk under its name, so that a crash here loses nothing.

    Raises
    ------
    RunFileError
        When it is being written by a live process, cannot be read, its name is taken by another run, or the disk has
        no room for the copy.
    """
    orphan = Path(path)
    if not orphan.name.endswith(PART_SUFFIX):
        raise RunFileError(f"{orphan}: not a run file left open, those end in {PART_SUFFIX}")
    if not orphan.is_file():
        raise RunFileError(f"{orphan}: no such file")
    target = orphan.with_name(orphan.name.removesuffix(PART_SUFFIX))
    if target.exists():
        raise RunFileError(f"{orphan}: {target.name} exists already, move one of the two away")
    _refuse_live(orphan)
    _check_room(orphan)
    try:
        with open_hdf5(orphan, RunFileError, swmr=True) as file:
            group = file["channels"]
            channels = {name: read_channel(group, name) for name in group}
            length = min((values.size for values in channels.values()), default=0)
            whole = {name: values[:length] for name, values in channels.items()}
            run = replace(run_from_attributes(file, whole, None), status="truncated")
    except DAMAGE as error:
        raise RunFileError(f"{orphan}: cannot be read ({_reason(error, orphan)})") from error
    write_run(target, run)
    orphan.unlink()
    sync_directory(orphan.parent)
    return target


def recover_directory(directory: str | os.PathLike[str]) -> tuple[Recovered, ...]:
    """Close every orphan below a directory and return the result for each; a second call finds none."""
    root = Path(directory)
    if not root.is_dir():
        raise RunFileError(f"{root}: no such directory")
    return tuple(_try(orphan) for orphan in sorted(root.rglob(f"*.h5{PART_SUFFIX}")))


def _try(orphan: Path) -> Recovered:
    try:
        path = recover(orphan)
        return Recovered(orphan=orphan, path=path, samples=read_run(path).samples)
    except RunFileError as error:
        return Recovered(orphan=orphan, path=None, samples=0, reason=str(error))


def _refuse_live(orphan: Path) -> None:
    handle = os.open(orphan, os.O_RDONLY)
    try:
        if not lock_part(handle, exclusive=True):
            raise RunFileError(f"{orphan}: a live process is writing it, stop that first")
    finally:
        os.close(handle)


def _check_room(orphan: Path) -> None:
    """Refuse where the copy has no room: HDF5 must not find a full disk."""
    DiskReserve(orphan.parent, whole_blocks(orphan.stat().st_size)).release()


def _reason(error: BaseException, orphan: Path) -> str:
    return " ".join(str(error).removeprefix(f"{orphan}: ").split())[:160]
