"""A run file while it is being captured: appended in blocks, readable after any crash."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import TracebackType

import h5py
import numpy as np
from numpy.typing import NDArray

from excitation.atomic import sync_directory, sync_file
from rigctl.errors import RunFileError
from rigctl.priority import drop_priority
from rigctl.runfile import (
    EVENT_BYTES,
    STATUSES,
    Run,
    encode_event,
    write_attributes,
    write_unit,
)

PART_SUFFIX = ".part"
BLOCK_SAMPLES = 500
FLUSH_INTERVAL_S = 0.2
CHUNK_SAMPLES = 4096
CACHE_BYTES = 2 * 8 * CHUNK_SAMPLES  # of each channel: written data are not read again, so memory stays constant
SYNC_S = 30.0


def part_path(path: Path) -> Path:
    """Name that a run file has while it is being written."""
    return path.with_name(path.name + PART_SUFFIX)


def lock_part(handle: int, *, exclusive: bool) -> bool:
    """Lock a part as in use (shared), or test whether it is free (exclusive); False where that fails."""
    if sys.platform == "win32":
        return True
    import fcntl

    try:
        fcntl.flock(handle, (fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


class RunWriter:
    """Writes ``<path>.part`` in HDF5's single-writer-multiple-reader mode and renames it when it is closed.

    `template` is a Run without samples: its channels are empty rows that name what will be appended. Samples
    reach the disk in blocks of at least 500 and, with fsync, every 0.2 s: after kill -9 all flushed samples
    are readable (:func:`rigctl.recover.recover`). Until it is closed the status in the file is ``truncated``.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        template: Run,
        *,
        clock: Callable[[], float] = time.monotonic,
        flush_interval_s: float = FLUSH_INTERVAL_S,
    ) -> None:
        self.path = Path(path)
        self.part = part_path(self.path)
        if self.path.exists() or self.part.exists():
            raise RunFileError(f"{self.path}: exists already, a captured run is never overwritten")
        if template.samples:
            raise RunFileError(f"{self.path}: the template has {template.samples} samples, it must have none")
        self._clock, self._flush_interval_s, self._last_flush = clock, flush_interval_s, clock()
        self._pending: list[Mapping[str, NDArray[np.float64]]] = []
        self._pending_samples = self.samples = 0
        # Made under another name, so that an incomplete part is never visible, not even after an interrupt.
        unborn = self.part.with_name(f".{self.part.name}.{os.getpid()}.new")
        try:
            self._file = h5py.File(unborn, "w", libver=("v110", "v110"), rdcc_nbytes=CACHE_BYTES)
        except OSError as error:
            raise RunFileError(f"{self.path}: cannot be created ({error})") from error
        try:
            self._channels = _lay_out(self._file, template)
            self._event_times, self._event_texts = self._file["events/time"], self._file["events/text"]
            self._file.swmr_mode = True
            self._disk = ThreadPoolExecutor(max_workers=1, thread_name_prefix="fsync", initializer=drop_priority)
            self._sync: Future[None] | None = None
            self._lock = os.open(unborn, os.O_RDONLY)
            lock_part(self._lock, exclusive=False)
            self.flush()
            unborn.replace(self.part)
        except BaseException:
            self._file.close()
            unborn.unlink(missing_ok=True)
            raise

    def append(self, block: Mapping[str, NDArray[np.float64]]) -> None:
        """Add one block: every channel of the template, equal lengths, finite; else RunFileError."""
        length = _block_length(self.path, block, tuple(self._channels), self.samples)
        self._pending.append(block)
        self._pending_samples += length
        self.samples += length
        if self._pending_samples >= BLOCK_SAMPLES:
            self._write_pending()
        if self._clock() - self._last_flush >= self._flush_interval_s:
            self._flush_soon()

    def event(self, time_s: float, text: str) -> None:
        """Add a time-stamped text, seconds from sample 0."""
        count = self._event_times.shape[0]
        self._event_times.resize((count + 1,))
        self._event_texts.resize((count + 1,))
        self._event_times[count], self._event_texts[count] = time_s, encode_event(text)

    def flush(self) -> None:
        """Force everything appended so far to the disk."""
        self._write_pending()
        self._file.flush()
        self._synced()
        os.fsync(self._lock)
        self._last_flush = self._clock()

    def _flush_soon(self) -> None:
        """Write to the system now, and sync to the disk in a thread: a slow disk must not delay the stream."""
        self._write_pending()
        self._file.flush()
        if self._sync is None or self._sync.done():
            self._synced()
            self._sync = self._disk.submit(os.fsync, self._lock)
        self._last_flush = self._clock()

    def _synced(self) -> None:
        """Wait for the sync to the disk and raise its error."""
        if self._sync is not None:
            done, self._sync = self._sync, None
            try:
                done.result(SYNC_S)
            except (OSError, TimeoutError) as error:
                raise RunFileError(
                    f"{self.path}: the disk does not take the samples ({error or 'no answer'})"
                ) from error

    def close(self, status: str) -> Path:
        """Close with the given status and rename the file; a second call changes nothing."""
        if status not in STATUSES:
            raise RunFileError(f"{self.path}: status is {status!r}, it must be one of {', '.join(STATUSES)}")
        if self._file.id.valid:
            self._release()
            with h5py.File(self.part, "r+") as file:
                file.attrs["samples"], file.attrs["status"] = self.samples, status
            sync_file(self.part)
            self.part.replace(self.path)
            sync_directory(self.path.parent)
        return self.path

    def _release(self) -> None:
        try:
            self.flush()
        finally:
            self._disk.shutdown(wait=False)
            self._file.close()
            os.close(self._lock)

    def _write_pending(self) -> None:
        if self._pending_samples:
            end = self.samples
            for name, dataset in self._channels.items():
                dataset.resize((end,))
                dataset[end - self._pending_samples :] = np.concatenate([block[name] for block in self._pending])
            self._pending, self._pending_samples = [], 0

    def __enter__(self) -> RunWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close("truncated")  # no effect where it was closed before


def _lay_out(file: h5py.File, template: Run) -> dict[str, h5py.Dataset]:
    write_attributes(file, template)
    file.attrs["samples"], file.attrs["status"] = 0, "truncated"
    channels = {}
    for name in template.channels:
        channels[name] = file.create_dataset(f"channels/{name}", (0,), "f8", maxshape=(None,), chunks=(CHUNK_SAMPLES,))
        write_unit(channels[name], template.units[name])
    file.create_dataset("events/time", (0,), "f8", maxshape=(None,), chunks=(64,)).attrs["unit"] = "s"
    file.create_dataset("events/text", (0,), f"S{EVENT_BYTES}", maxshape=(None,), chunks=(64,))
    return channels


def _block_length(path: Path, block: Mapping[str, NDArray[np.float64]], names: tuple[str, ...], start: int) -> int:
    if set(block) != set(names):
        raise RunFileError(f"{path}: block has channels {sorted(block)}, the file has {sorted(names)}")
    lengths = {values.shape for values in block.values()}
    if len(lengths) != 1:
        raise RunFileError(f"{path}: block of unequal channels {lengths}")
    for name, values in block.items():
        if not np.isfinite(values).all():
            bad = np.flatnonzero(~np.isfinite(values))
            raise RunFileError(f"{path}: channel {name}: sample {start + bad[0]} is {values[bad[0]]}, not finite")
    return int(next(iter(block.values())).size)
