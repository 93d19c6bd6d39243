"""An HDF5 file where a file of another program is due: what it holds, in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import h5py

from excitation.untrusted import DAMAGE, open_hdf5
from rigctl.errors import ForeignFileError

__all__ = ["foreign_hdf5"]

_SHOWN: Final = 5  # datasets
_MOST: Final = 200  # that are looked at


def foreign_hdf5(path: Path) -> str:
    """Why it is not imported: a run file needs none, and what an HDF5 file of another program means is not written in
    it.
    """
    found: list[str] = []

    def note(name: str, item: Any) -> bool | None:  # Any: a group or a dataset
        if isinstance(item, h5py.Dataset):
            found.append(f"{name} {'×'.join(map(str, item.shape or ()))}".rstrip())
        return True if len(found) > _MOST else None

    try:
        with open_hdf5(path, ForeignFileError) as file:
            if "format" in file.attrs:
                return f"an HDF5 file of format {str(file.attrs['format'])!r:.60}: a run file is used as it is"
            file.visititems(note)
    except (ForeignFileError, *DAMAGE):
        return "an HDF5 file, damaged or with links: a run file is used as it is, others are not read; export it as CSV"
    shown = "; ".join(found[:_SHOWN]) + (" …" if len(found) > _SHOWN else "")
    return (
        f"an HDF5 file of another program, which holds {shown or 'no data'}: such files are not read, as their units "
        "and times are nowhere in one place; export it as CSV or MAT"
    )
