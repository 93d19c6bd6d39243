"""What a study has done so far, in a file: an interrupted study goes on where it was."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, nullcontext
from contextvars import ContextVar
from pathlib import Path
from threading import Lock
from typing import IO

import numpy as np
from numpy.typing import NDArray

from excitation.kernel_cache import digest
from identification.compute import finished
from identification.compute.executor import Item
from identification.errors import OutputError
from identification.studies.pace import Tell, with_time_left

Floats = NDArray[np.float64]

_HEAD = b"damper-rig/study journal 2 "
_NUMBER = np.dtype("<i8")
_DIGEST = 32
_DIMENSIONS = 8
_SOURCES = Path(__file__).parents[1]


class Journal:
    """Values by what was asked, in memory and in a file. A record that was cut off while it was written is left out.

    The file is made with the first value. It belongs to the sources that wrote it: those of others are not used.
    """

    def __init__(self, path: Path) -> None:
        """Reads what is there."""
        self._path, self._head = path, _HEAD + digest(_SOURCES).encode() + b"\n"
        self._file: IO[bytes] | None = None
        self._lock = Lock()
        self._done = _read(path, self._head)

    def get(self, key: bytes) -> Floats | None:
        """The value that was asked for before; None where there is none."""
        return self._done.get(key)

    def add(self, key: bytes, value: Floats) -> None:
        """Keeps a value; raises OutputError where it cannot be written. Safe to use from threads."""
        with self._lock:
            try:
                if self._file is None:
                    self._file = self._opened()
                self._file.write(_record(key, value))
                self._file.flush()
            except OSError as error:
                raise OutputError(
                    f"{self._path}: cannot be written ({error.strerror or error}): give another place"
                ) from error
            self._done[key] = value

    def close(self) -> None:
        """Close the file; safe to call twice."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def remove(self) -> None:
        """The study is done: nothing is kept."""
        self.close()
        self._path.unlink(missing_ok=True)

    def _opened(self) -> IO[bytes]:
        """The file with its whole records, to append to; its folder is made where there is none."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        temporary = self._path.with_name(f"{self._path.name}.{os.getpid()}.tmp")
        temporary.write_bytes(self._head + b"".join(_record(k, v) for k, v in self._done.items()))
        temporary.replace(self._path)
        return self._path.open("ab")


_CURRENT: ContextVar[Journal | None] = ContextVar("journal", default=None)


@contextmanager
def kept(path: Path | None) -> Iterator[None]:
    """Let studies within keep what they have done at `path`, and go on from it; removed where all within is done."""
    if path is None:
        yield
        return
    journal = Journal(path)
    before = _CURRENT.set(journal)
    try:
        yield
    except BaseException:
        journal.close()
        raise
    else:
        journal.remove()
    finally:
        _CURRENT.reset(before)


def carried(
    function: Callable[[Item], Floats], items: Sequence[Item], keys: Sequence[bytes], *, what: str, tell: Tell
) -> list[Floats]:
    """`function` of every item on the executor, in order; those that the journal of the context holds are not done.

    Two items of one key are the same: `key_of` makes one. Raises OutputError where the journal cannot be written, and
    what `function` raises.
    """
    journal = _CURRENT.get()
    done = {} if journal is None else {k: v for k, key in enumerate(keys) if (v := journal.get(key)) is not None}
    told = with_time_left(tell, what, already=len(done))
    left = [k for k in range(len(items)) if k not in done]
    with closing(finished(function, [items[k] for k in left])) as come:
        for index, value in come:
            done[left[index]] = value
            if journal is not None:
                journal.add(keys[left[index]], value)
            told(len(done), len(items))
    return [done[k] for k in range(len(items))]


def key_of(*parts: bytes) -> bytes:
    """The key of what these tell from all else."""
    found = hashlib.sha256()
    for part in parts:
        found.update(len(part).to_bytes(8, "little") + part)
    return found.digest()


def carry_on(
    function: Callable[[Floats], Floats],
    items: Sequence[Floats],
    *,
    identity: bytes,
    journal: Path | None,
    what: str,
    tell: Tell,
) -> list[Floats]:
    """`carried` for arrays; `identity` tells the function from others. A `journal` is kept for this work alone.

    Raises
    ------
    OutputError
        Where the journal cannot be written.
    """
    keys = [key_of(identity, np.ascontiguousarray(item).tobytes(), str(item.shape).encode()) for item in items]
    with nullcontext() if journal is None else kept(journal):
        return carried(function, items, keys, what=what, tell=tell)


def _read(path: Path, head: bytes) -> dict[bytes, Floats]:
    """The whole records of the file, where it is of these sources."""
    try:
        data = path.read_bytes()
    except OSError:
        return {}
    if data[: len(head)] != head:
        return {}
    done, at = dict[bytes, Floats](), len(head)
    while (found := _whole(data, at)) is not None:
        key, value, at = found
        done[key] = value
    return done


def _whole(data: bytes, at: int) -> tuple[bytes, Floats, int] | None:
    """Key, value and end of the record at a place; None where there is no whole one."""
    begin = at + _DIGEST
    if len(data) < begin + 8:
        return None
    count = int(np.frombuffer(data[begin : begin + 8], dtype=_NUMBER)[0])
    if not 0 <= count <= _DIMENSIONS or len(data) < begin + 8 + 8 * count:
        return None
    values = begin + 8 + 8 * count
    shape = tuple(int(n) for n in np.frombuffer(data[begin + 8 : values], dtype=_NUMBER))
    if any(n < 0 for n in shape):
        return None
    end = values + 8 * int(np.prod(shape, dtype=object))
    if len(data) < end + _DIGEST or hashlib.sha256(data[at:end]).digest() != data[end : end + _DIGEST]:
        return None
    value = np.frombuffer(data[values:end], dtype="<f8").reshape(shape).astype(np.float64)
    return data[at:begin], value, end + _DIGEST


def _record(key: bytes, value: Floats) -> bytes:
    body = key + np.array([value.ndim, *value.shape], dtype=_NUMBER).tobytes()
    body += np.ascontiguousarray(value, dtype="<f8").tobytes()
    return body + hashlib.sha256(body).digest()
