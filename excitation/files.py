"""Excitation files out and in, by the ending of their name."""

from __future__ import annotations

import csv
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

from excitation.atomic import written_whole
from excitation.errors import ExcitationError, ExcitationFileError
from excitation.hdf5 import read_hdf5, write_hdf5
from excitation.matlab import read_mat, write_mat
from excitation.plan import MakeExcitation, Test, TestPlan
from excitation.plan_files import holds_a_plan, write_plan
from excitation.plan_files import read_plan as read_plan_file
from excitation.rpc3 import write_drive, write_response
from excitation.rpc3_design import read_own_drive
from excitation.signal import Excitation
from excitation.spreadsheet import read_csv, write_csv
from excitation.synthesis import excitation_from_config
from excitation.untrusted import DAMAGE

__all__ = ["READABLE", "WRITABLE", "read_excitation", "read_plan", "write_excitation", "write_plan"]

Handler = TypeVar("Handler")

_WRITERS: Mapping[str, Callable[[Path, Excitation], None]] = {
    ".h5": write_hdf5,
    ".csv": write_csv,
    ".mat": write_mat,
    ".drv": write_drive,
    ".rsp": write_response,
}
_READERS: Mapping[str, Callable[[Path], Excitation]] = {
    ".h5": read_hdf5,
    ".csv": read_csv,
    ".mat": read_mat,
    ".drv": read_own_drive,
    ".rsp": read_own_drive,
}

WRITABLE = tuple(_WRITERS)
READABLE = tuple(_READERS)


def write_excitation(path: Path | str, excitation: Excitation) -> None:
    """Writes the file whole or not at all; the ending says the format.

    Raises ExcitationFileError for an unknown ending or a place that cannot be written.
    """
    path = Path(path)
    writer = _by_ending(path, _WRITERS)
    with written_whole(path, ExcitationFileError) as temporary:
        writer(temporary, excitation)


def read_excitation(path: Path | str) -> Excitation:
    """Reads an excitation; raises ExcitationFileError, one line that names the file and the place in it."""
    path = Path(path)
    reader = _by_ending(path, _READERS)
    if not path.is_file():
        raise ExcitationFileError(f"{path}: no such file: give an excitation file ({', '.join(_READERS)})")
    try:
        return reader(path)
    except OSError as error:  # h5py: a damaged or foreign file is an OSError
        raise ExcitationFileError(f"{path}: cannot be read as {path.suffix}: {_first_line(error)}") from error
    except UnicodeDecodeError as error:
        raise ExcitationFileError(f"{path}: byte {error.start} is not UTF-8 text: save it as UTF-8") from error
    except ExcitationError:
        raise
    except (*DAMAGE, zlib.error, csv.Error) as error:
        raise ExcitationFileError(f"{path}: damaged: {_first_line(error)}") from error


def read_plan(path: Path | str, make: MakeExcitation = excitation_from_config) -> TestPlan:
    """Reads a plan (.toml, .csv, .h5), its designs by ``make``; an excitation file of any ending is a plan of one
    test, named after it.

    Raises ExcitationFileError or DesignError, one line that names the file and the place in it.
    """
    path = Path(path)
    if holds_a_plan(path):
        return read_plan_file(path, make)
    return TestPlan(tests=(Test(name=path.stem, excitation=read_excitation(path)),))


def _by_ending(path: Path, known: Mapping[str, Handler]) -> Handler:
    handler = known.get(path.suffix.lower())
    if handler is None:
        raise ExcitationFileError(f"{path}: the ending {path.suffix!r} is not known: use {', '.join(known)}")
    return handler


def _first_line(error: BaseException) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
