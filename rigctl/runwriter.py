"""A run file while it is being captured: appended in blocks, readable after any crash."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType

import h5py
import numpy as np
from numpy.typing import NDArray

from excitation.atomic import sync_directory, sync_file
from rigctl.disk_reserve import CHUNK_SAMPLES, CLOSING_BYTES, DiskReserve, allocate, run_bytes, whole_blocks
from rigctl.errors import RunFileError
from rigctl.priority import drop_priority
from rigctl.runfile import (
    EVENT_BYTES,
    STATUSES,
    UTC_BYTES,
    Run,
    encode_event,
    write_attributes,
    write_unit,
)
from rigctl.salvage import DISK_ERRORS, close_anyway
from rigctl.setup import put_setup

PART_SUFFIX = ".part"
BLOCK_SAMPLES = 500
FLUSH_INTERVAL_S = 0.2
CACHE_BYTES = 2 * 8 * CHUNK_SAMPLES  # of each channel: written data are not read again, so memory stays constant
SYNC_S = 30.0
MARK_BYTES = 1 << 16  # for the attributes that are written when the file is closed; HDF5 cuts off what it does not need
SPARE_BYTES = 1 << 18  # for whatever else HDF5 may write in one flush: blocks of its indices, attributes, events


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

    Disk space for `expected_samples` is taken at once, and before HDF5 writes anything the file is made long enough for
    it: HDF5 must not find a full disk, because it then damages its own state, loses samples, and may take the process
    down at the end. Where the disk is full all the same, ``append`` raises and keeps what comes in memory, and
    ``close`` writes that into the space that was reserved for it.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        template: Run,
        *,
        expected_samples: int = 0,
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
        self._names = tuple(template.channels)
        self._pending: list[Mapping[str, NDArray[np.float64]]] = []
        self._pending_samples = self._flushed_samples = self.samples = 0
        self._rows: list[dict[str, float | bytes]] = []  # events that are not in the file yet
        self._full = self._broken = False  # the disk; HDF5's own state
        self._lost: RunFileError | None = None
        self._whole_bytes = whole_blocks(run_bytes(expected_samples, len(self._names)) + CLOSING_BYTES)
        self._reserve = DiskReserve(self.path.parent, self._whole_bytes)
        self._last_reserve = DiskReserve(self.path.parent, MARK_BYTES)
        try:
            self._create(template)
        except BaseException:
            self._reserve.release()
            self._last_reserve.release()
            raise

    def _create(self, template: Run) -> None:
        # Made under another name, so that an incomplete part is never visible, not even after an interrupt.
        unborn = self.part.with_name(f".{self.part.name}.{os.getpid()}.new")
        try:
            self._file = h5py.File(unborn, "w", libver=("v110", "v110"), rdcc_nbytes=CACHE_BYTES)
        except OSError as error:
            raise RunFileError(f"{self.path}: cannot be created ({error})") from error
        try:
            self._lock = os.open(unborn, os.O_RDWR)
            attributes = whole_blocks(SPARE_BYTES + len(json.dumps(template.design)))
            self._reserve.keep(self._whole_bytes - attributes)
            allocate(self._lock, 0, attributes)
            self._channels = _lay_out(self._file, template)
            # opened once: HDF5 also writes when it closes a data set, and reports an error there to nobody
            self._events = {name: self._file[f"events/{name}"] for name in self._file["events"]}
            self._file.swmr_mode = True
            self._disk = ThreadPoolExecutor(max_workers=1, thread_name_prefix="fsync", initializer=drop_priority)
            self._sync: Future[None] | None = None
            lock_part(self._lock, exclusive=False)
            self.flush()
            unborn.replace(self.part)
        except BaseException as error:
            close_anyway(self._file, unborn)
            unborn.unlink(missing_ok=True)
            if isinstance(error, DISK_ERRORS):
                raise RunFileError(f"{self.path}: cannot be created ({_short(error)})") from error
            raise

    def append(self, block: Mapping[str, NDArray[np.float64]]) -> None:
        """Add one block: every channel of the template, equal lengths, finite; else RunFileError.

        RunFileError too where the disk does not take it; later blocks are then kept in memory until ``close``.
        """
        length = _block_length(self.path, block, self._names, self.samples)
        self._pending.append(block)
        self._pending_samples += length
        self.samples += length
        if self._full or self._broken:
            return
        with self._writing():
            if self._pending_samples >= BLOCK_SAMPLES:
                self._write_pending()
            if self._clock() - self._last_flush >= self._flush_interval_s:
                self._flush_soon()

    def event(self, time_s: float, text: str) -> None:
        """Add a text with its time, seconds from sample 0, and the time of day; ``close`` writes it to a full disk."""
        self._rows.append(
            {
                "time": time_s,
                "text": encode_event(text),
                "utc": datetime.now(UTC).isoformat(timespec="milliseconds").encode(),
            }
        )
        if not (self._full or self._broken):
            with self._writing():
                self._write_events()

    def flush(self) -> None:
        """Force everything appended so far to the disk."""
        self._flush_to_system()
        self._synced()
        os.fsync(self._lock)
        self._last_flush = self._clock()

    def _flush_soon(self) -> None:
        """Write to the system now, and sync to the disk in a thread: a slow disk must not delay the stream."""
        self._flush_to_system()
        if self._sync is None or self._sync.done():
            self._synced()
            self._sync = self._disk.submit(os.fsync, self._lock)
        self._last_flush = self._clock()

    def _flush_to_system(self) -> None:
        self._write_pending()
        self._take_space(self.samples)
        with self._by_hdf5():
            self._file.flush()
        self._flushed_samples = self.samples
        self._take_space(self.samples)  # HDF5 has cut off what it did not need: take it again before others do

    def _take_space(self, samples: int) -> None:
        """Make the file long enough for everything that HDF5 may write until it has so many samples; else OSError."""
        channels, size = len(self._names), self._file.id.get_filesize()
        growth = run_bytes(samples, channels) - run_bytes(self._flushed_samples, channels) + SPARE_BYTES
        end = whole_blocks(size + growth)
        self._reserve.keep(self._whole_bytes - end)
        allocate(self._lock, size, end - size)

    @contextmanager
    def _by_hdf5(self) -> Iterator[None]:
        """After an error inside HDF5 it must not be used again: its state is damaged."""
        try:
            yield
        except DISK_ERRORS:
            self._broken = True
            raise

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Turn an error of the disk into RunFileError; from then on nothing is written before ``close``."""
        try:
            yield
        except DISK_ERRORS as error:
            self._full = True
            raise RunFileError(
                f"{self.path}: the disk does not take sample {self._flushed_samples} and later ({_short(error)})"
            ) from error
        except RunFileError:
            self._full = True
            raise

    def _synced(self) -> None:
        """Wait for the sync to the disk and raise its error."""
        if self._sync is not None:
            done, self._sync = self._sync, None
            try:
                done.result(SYNC_S)
            except (OSError, TimeoutError) as error:
                raise RunFileError(
                    f"{self.path}: the disk does not take the samples ({_short(error) or 'no answer'})"
                ) from error

    def close(self, status: str) -> Path:
        """Close with the given status and rename the file; a second call changes nothing.

        Raises RunFileError where the disk fails for good: what was flushed is in the part, for ``recover``.
        """
        if status not in STATUSES:
            raise RunFileError(f"{self.path}: status is {status!r}, it must be one of {', '.join(STATUSES)}")
        if self._lost is not None:
            raise self._lost
        if self._file.id.valid:
            try:
                try:
                    self._release()
                finally:
                    self._last_reserve.release()
                _mark(self.part, self.samples, status)
            except (*DISK_ERRORS, RunFileError) as error:
                self._lost = RunFileError(
                    f"{self.path}: cannot be closed ({_short(error)}): its samples are in {self.part.name}: "
                    "free space; 'damper-rig recover' closes it, a service closes it itself"
                )
                raise self._lost from error
            self.part.replace(self.path)
            sync_directory(self.path.parent)
        return self.path

    def discard(self) -> None:
        """Remove the file: nothing was recorded."""
        self._release()
        self._last_reserve.release()
        self.part.unlink(missing_ok=True)

    def _release(self) -> None:
        """Write what the disk takes, and close HDF5's file in any case."""
        self._reserve.release()
        try:
            if not self._broken:
                self._write_rest()
        finally:
            with suppress(RunFileError):
                self._synced()  # the thread must not sync a file that is closed
            self._disk.shutdown(wait=False)
            if self._broken:
                close_anyway(self._file, self.part)
            self._file.close()
            os.close(self._lock)
        if self._broken:
            raise RunFileError("the disk has failed")

    def _write_rest(self) -> None:
        """Write everything; where the disk was full and still is, what HDF5 had already is the whole run."""
        known_full, self._full = self._full, True
        try:
            self._write_pending()
            self._write_events()
            self._flush_to_system()
        except OSError:
            if self._broken or not known_full:
                raise
            self.samples -= self._pending_samples  # HDF5 has the others, and space for them
        self._synced()
        os.fsync(self._lock)

    def _write_pending(self) -> None:
        if self._pending_samples:
            start, end = self.samples - self._pending_samples, self.samples
            self._take_space(end)
            with self._by_hdf5():
                for name, dataset in self._channels.items():
                    dataset.resize((end,))
                    dataset[start:] = np.concatenate([block[name] for block in self._pending])
            self._pending, self._pending_samples = [], 0

    def _write_events(self) -> None:
        if self._rows:
            self._take_space(self.samples)
        with self._by_hdf5():
            for row in self._rows:
                count = self._events["time"].shape[0]
                for name, value in row.items():
                    self._events[name].resize((count + 1,))
                    self._events[name][count] = value
        self._rows = []

    def __enter__(self) -> RunWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close("truncated")  # no effect where it was closed before


def _mark(part: Path, samples: int, status: str) -> None:
    """Write how the run ended into its closed file, with space for it taken first: HDF5 must not find a full disk."""
    with part.open("r+b") as file:
        allocate(file.fileno(), os.fstat(file.fileno()).st_size, MARK_BYTES)
    with h5py.File(part, "r+") as file:
        file.attrs["samples"], file.attrs["status"] = samples, status
    sync_file(part)


def _short(error: BaseException) -> str:
    number = getattr(error, "errno", None)  # HDF5 puts all that it knows into the text, on several lines
    return os.strerror(number) if number else " ".join(str(error).split())[:160]


def _lay_out(file: h5py.File, template: Run) -> dict[str, h5py.Dataset]:
    write_attributes(file, template)
    file.attrs["samples"], file.attrs["status"] = 0, "truncated"
    channels = {}
    for name in template.channels:
        channels[name] = file.create_dataset(f"channels/{name}", (0,), "f8", maxshape=(None,), chunks=(CHUNK_SAMPLES,))
        write_unit(channels[name], template.units[name])
    put_setup(file, template.setup)
    file.create_dataset("events/time", (0,), "f8", maxshape=(None,), chunks=(64,)).attrs["unit"] = "s"
    file.create_dataset("events/text", (0,), f"S{EVENT_BYTES}", maxshape=(None,), chunks=(64,))
    file.create_dataset("events/utc", (0,), f"S{UTC_BYTES}", maxshape=(None,), chunks=(64,))
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
