"""A stored drive: an excitation file with its target beside the drive, so that an iteration can start from it again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray

from excitation.atomic import written_whole
from excitation.errors import ExcitationError, ExcitationFileError
from excitation.files import read_excitation
from excitation.hdf5 import write_hdf5
from excitation.signal import Excitation
from excitation.untrusted import DAMAGE, open_hdf5
from rigctl.errors import IterationError, RunFileError
from rigctl.iterate import Channel, Iterated, moving_channels
from rigctl.runfile import read_channel

__all__ = ["StoredDrive", "read_drive", "write_drive"]

UNITS = {Channel.MOTION: "m", Channel.CURRENT: "A"}
SAME = 1e-9  # of a target's range: beyond the rounding of files, below one count of any wire


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StoredDrive:
    """A drive, the targets that it is for, and the rig on which it was made."""

    path: Path
    drive: Excitation
    targets: dict[Channel, NDArray[np.float64]]  # (N,)
    rig: str

    def check_rig(self, rig: str) -> None:
        """Raise IterationError, one line, where this drive was made on another rig."""
        if rig != self.rig:
            self._refuse(f"it was made on the rig {self.rig!r}, this one is {rig!r}")

    def check_target(self, target: Excitation, *, motion_only: bool = False) -> None:
        """Raise IterationError, one line, where this is no drive for the target."""
        found, wanted = self.drive, target
        if found.sample_rate_hz != wanted.sample_rate_hz:
            self._refuse(f"its sample rate is {found.sample_rate_hz:g} Hz, the target has {wanted.sample_rate_hz:g} Hz")
        if (found.samples, found.period_samples) != (wanted.samples, wanted.period_samples):
            self._refuse(
                f"it has {found.samples} samples with a period of {found.period_samples}, "
                f"the target has {wanted.samples} with {wanted.period_samples}"
            )
        if (found.current_a is None) != (wanted.current_a is None):
            self._refuse("one of drive and target has a current, the other has none")
        channels = moving_channels(target, motion_only=motion_only)
        if channels != tuple(self.targets):
            self._refuse(f"it was iterated in {_names(self.targets)}, wanted is {_names(channels)}")
        self._check_values(target)

    def _check_values(self, target: Excitation) -> None:
        pairs = {Channel.MOTION: (self.drive.displacement_m, target.displacement_m)}
        if self.drive.current_a is not None and target.current_a is not None:
            pairs[Channel.CURRENT] = (self.drive.current_a, target.current_a)
        for channel, (played, wanted) in pairs.items():
            stored = self.targets.get(channel, played)  # a channel that was not iterated is played as wanted
            bad = np.flatnonzero(~(np.abs(stored - wanted) <= SAME * max(np.ptp(wanted), np.max(np.abs(wanted)))))
            if bad.size:
                first = bad[0]
                self._refuse(
                    f"it was made for another target: its {channel} is {stored[first]:.6g} {UNITS[channel]} "
                    f"at sample {first}, wanted is {wanted[first]:.6g}"
                )

    def _refuse(self, why: str) -> None:
        raise IterationError(f"{self.path}: {why}: iterate from the plain command, without --from")


def write_drive(path: Path, iterated: Iterated) -> None:
    """Store the iterated drive as an excitation file, its targets beside it in channels ``displacement_target``, ….

    Raises ExcitationFileError where the place cannot be written.
    """
    columns = {Channel.MOTION: iterated.target.displacement_m, Channel.CURRENT: iterated.target.current_a}
    with written_whole(path, ExcitationFileError) as temporary:
        write_hdf5(temporary, iterated.drive)
        with h5py.File(temporary, "r+") as file:
            file.attrs["iteration_rig"] = iterated.rig
            for channel in iterated.channels:
                target = file.create_dataset(f"channels/{channel}_target", data=columns[channel])
                target.attrs["unit"] = UNITS[channel]
                target.attrs["description"] = "what the drive makes"


def read_drive(path: Path) -> StoredDrive:
    """Read a stored drive and check all of it; IterationError, one line, where it cannot be used."""
    try:
        drive = read_excitation(path)
        with open_hdf5(path, IterationError) as file:
            rig = file.attrs.get("iteration_rig")
            targets = {
                channel: _target(file, channel) for channel in Channel if f"{channel}_target" in file["channels"]
            }
    except IterationError:
        raise
    except (ExcitationError, RunFileError) as error:
        text = str(error)
        raise IterationError(text if text.startswith(str(path)) else f"{path}: {text}") from error
    except DAMAGE as error:
        raise IterationError(f"{path}: cannot be read as a drive ({' '.join(str(error).split())[:160]})") from error
    if not isinstance(rig, str) or not rig or not targets:
        raise IterationError(f"{path}: no stored drive: give a .drive.h5 that 'damper-rig iterate' wrote")
    for channel, values in targets.items():
        if values.size != drive.samples:
            raise IterationError(f"{path}: {channel}_target has {values.size} samples, the drive {drive.samples}")
    return StoredDrive(path=path, drive=drive, targets=targets, rig=rig)


def _target(file: h5py.File, channel: Channel) -> NDArray[np.float64]:
    name = f"{channel}_target"
    values = read_channel(file["channels"], name)
    unit = file["channels"][name].attrs.get("unit")
    if unit != UNITS[channel]:
        raise IterationError(f"{file.filename}: {name} has unit {unit!r}: it must be {UNITS[channel]!r}")
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise IterationError(f"{file.filename}: {name}, sample {bad[0]} is {values[bad[0]]}: it must be finite")
    return values


def _names(channels: Sequence[Channel] | dict[Channel, NDArray[np.float64]]) -> str:
    return " and ".join(channels) or "nothing"
