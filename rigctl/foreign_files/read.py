"""Which reader a file needs, by its first bytes and its ending."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final

from excitation.untrusted import bounded_memory
from rigctl.errors import ForeignFileError
from rigctl.foreign_endings import WORKBOOKS
from rigctl.foreign_files.choice import Choice
from rigctl.foreign_files.hdf5_file import foreign_hdf5
from rigctl.foreign_files.matlab_file import read_matlab
from rigctl.foreign_files.recorder_files import read_mdf, read_parquet, read_tdms, read_uff
from rigctl.foreign_files.rpc_file import read_rpc
from rigctl.foreign_files.table import Table
from rigctl.foreign_files.text_file import read_text
from rigctl.foreign_files.workbook import read_workbook

__all__ = ["BINARY_READERS", "read_tables", "refusing"]

Reader = Callable[[Path], tuple[Table, ...]]

BINARY_READERS: Final[dict[str, Reader]] = {
    ".mat": read_matlab,
    ".rsp": read_rpc,
    ".drv": read_rpc,
    ".rpc": read_rpc,
    ".tim": read_rpc,
    ".uff": read_uff,
    ".unv": read_uff,
    ".ufb": read_uff,
    ".mf4": read_mdf,
    ".mdf": read_mdf,
    ".tdms": read_tdms,
    ".parquet": read_parquet,
    ".pq": read_parquet,
}
_BY_FIRST_BYTES: Final[tuple[tuple[bytes, str], ...]] = (
    (b"PK\x03\x04", ".xlsx"),
    (b"MATLAB ", ".mat"),
    (b"MDF ", ".mf4"),
    (b"TDSm", ".tdms"),
    (b"PAR1", ".parquet"),
    (b"FORMAT\0", ".rsp"),
)
# Beside the file itself: the libraries, some copies of a small file, and what a thread takes of the address space.
_MEMORY: Final = 3 << 30
_COPIES: Final = 8  # of the size of the file: an XLSX unpacks to some ten times its size, of which rows are kept


def read_tables(path: Path, choice: Choice) -> tuple[Table, ...]:
    """The tables of a file of any known format.

    Raises
    ------
    ForeignFileError
        One line that begins with the name of the file.
    """
    if path.is_dir():
        raise ForeignFileError(f"{path}: a folder: name its files, or read it with --mapping")
    if not path.is_file():
        raise ForeignFileError(f"{path}: no such file")
    with refusing(path):
        size = path.stat().st_size
        if size == 0:
            raise ForeignFileError("it is empty: give a file with a line for each sample")
        ending = _ending(path)
        if ending in WORKBOOKS:
            return read_workbook(path, choice.text)
        if ending in BINARY_READERS:
            return BINARY_READERS[ending](path)
        return read_text(path, choice.text)


class refusing:
    """Within it, errors are refusals that name the file, and memory is bounded by its size."""

    def __init__(self, path: Path) -> None:
        self._path = path
        size = path.stat().st_size if path.is_file() else 0
        self._bound = bounded_memory(_MEMORY + _COPIES * size)

    def __enter__(self) -> None:
        self._bound.__enter__()

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        self._bound.__exit__(None, None, None)
        if isinstance(error, ForeignFileError):
            raise ForeignFileError(f"{self._path}: {str(error).removeprefix(f'{self._path}: ')}") from error
        if isinstance(error, MemoryError):
            raise ForeignFileError(
                f"{self._path}: it takes more memory than a file of its size can mean: save it again, or as CSV"
            ) from error
        if isinstance(error, OSError):
            raise ForeignFileError(f"{self._path}: cannot be read ({error.strerror or error})") from error
        if isinstance(error, UnicodeError):
            raise ForeignFileError(f"{self._path}: not text in this encoding ({error}): state another one") from error


def _ending(path: Path) -> str:
    """The ending that its first bytes ask for, and else its own."""
    with path.open("rb") as file:
        start = file.read(64)
    by_bytes = next((ending for first, ending in _BY_FIRST_BYTES if start.startswith(first)), None)
    if by_bytes is not None:
        return by_bytes
    if start.startswith(b"\x89HDF\r\n\x1a\n"):
        raise ForeignFileError(foreign_hdf5(path))
    if start.startswith(b"\xd0\xcf\x11\xe0"):
        raise ForeignFileError("an Excel workbook of the old format (.xls): save it as .xlsx or .csv")
    if start.lstrip().startswith(b"-1\n") or b"\n    58" in start or b"\r\n    58" in start:
        return ".uff"
    return path.suffix.casefold()
