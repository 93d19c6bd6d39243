"""Drive files with a design: where its 16-bit samples are those of the design, rounded, these are used."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from excitation.errors import ExcitationError
from excitation.rpc3 import read_drive
from excitation.signal import Excitation
from excitation.synthesis import excitation_from_config, reads_a_file

__all__ = ["read_own_drive"]

_HALF_A_STEP: Final = 0.5 / 32767 * (1 + 1e-6)  # of a channel's peak: the rounding of a 16-bit writer


def read_own_drive(path: Path) -> Excitation:
    """The excitation in a drive or response file.

    Where its design makes the stored samples up to the rounding to 16 bits, it is that of the design: rounded samples
    have an acceleration that no rig would accept. Another program may have changed the samples: then they stay.

    Raises ExcitationFileError, as ``read_drive`` does.
    """
    read = read_drive(path)
    if "kind" not in read.design or reads_a_file(read.design):
        return read
    try:
        made = excitation_from_config(read.design)
    except ExcitationError:
        return read
    stated = (made.kind, made.sample_rate_hz, made.period_samples, made.samples)
    if stated != (read.kind, read.sample_rate_hz, read.period_samples, read.samples):
        return read
    same = _is_rounded(read.displacement_m, made.displacement_m) and _is_rounded(read.current_a, made.current_a)
    return made if same else read


def _is_rounded(read: NDArray[np.float64] | None, made: NDArray[np.float64] | None) -> bool:
    if read is None or made is None:
        return read is made
    return bool(np.abs(read - made).max() <= _HALF_A_STEP * np.abs(made).max())
