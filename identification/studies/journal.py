"""What a study has done so far, in a file: an interrupted study goes on where it was."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from excitation.kernel_cache import digest
from identification.compute import finished
from identification.errors import OutputError
from identification.studies.pace import Tell, with_time_left

Floats = NDArray[np.float64]

_HEAD = b"damper-rig/study journal 1 "
_NUMBER = np.dtype("<i8")
_DIGEST = 32
_HERE = Path(__file__).parent


def carry_on(
    function: Callable[[Floats], Floats],
    items: Sequence[Floats],
    *,
    identity: bytes,
    journal: Path | None,
    what: str,
    tell: Tell,
) -> list[Floats]:
    """`function` of every item on the executor, in order; those that the journal holds already are not done again.

    The journal belongs to these items and to the work that `identity` tells from others: one of other work is begun
    anew. It is removed when all is done. A record that was cut off while it was written is done again.

    Raises
    ------
    OutputError
        Where the journal cannot be written.
    """
    done = {} if journal is None else _read(journal, _mark(identity, items))
    told = with_time_left(tell, what, already=len(done))
    left = [k for k in range(len(items)) if k not in done]
    file = None if journal is None or not left else _opened(journal, _mark(identity, items), done)
    try:
        with closing(finished(function, [items[k] for k in left])) as come:
            for index, value in come:
                done[left[index]] = value
                if file is not None:
                    _append(file, left[index], value)
                told(len(done), len(items))
    finally:
        if file is not None:
            file.close()
    if journal is not None:
        journal.unlink(missing_ok=True)
    return [done[k] for k in range(len(items))]


def _mark(identity: bytes, items: Sequence[Floats]) -> bytes:
    """The same for the same work by the same sources."""
    found = hashlib.sha256(digest(_HERE).encode() + identity)
    for item in items:
        found.update(np.ascontiguousarray(item).tobytes())
    return found.digest()


def _read(journal: Path, identity: bytes) -> dict[int, Floats]:
    """The whole records of the journal, where it is of this work."""
    try:
        data = journal.read_bytes()
    except OSError:
        return {}
    head = _HEAD + identity
    if data[: len(head)] != head:
        return {}
    done, at = dict[int, Floats](), len(head)
    while (record := _record(data, at)) is not None:
        index, value, at = record
        done[index] = value
    return done


def _record(data: bytes, at: int) -> tuple[int, Floats, int] | None:
    """Index, value and end of the record at a place; None where there is no whole one."""
    fixed = np.frombuffer(data[at : at + 16], dtype=_NUMBER) if len(data) >= at + 16 else np.zeros(0, dtype=_NUMBER)
    if fixed.size < 2 or not 0 <= fixed[1] <= 8:
        return None
    begin = at + 16 + 8 * int(fixed[1])
    shape = tuple(int(n) for n in np.frombuffer(data[at + 16 : begin], dtype=_NUMBER))
    end = begin + 8 * int(np.prod(shape, dtype=np.int64))
    if len(shape) < fixed[1] or len(data) < end + _DIGEST:
        return None
    if hashlib.sha256(data[at:end]).digest() != data[end : end + _DIGEST]:
        return None
    value = np.frombuffer(data[begin:end], dtype="<f8").reshape(shape).astype(np.float64)
    return int(fixed[0]), value, end + _DIGEST


def _bytes(index: int, value: Floats) -> bytes:
    fixed = np.array([index, value.ndim, *value.shape], dtype=_NUMBER).tobytes()
    body = fixed + np.ascontiguousarray(value, dtype="<f8").tobytes()
    return body + hashlib.sha256(body).digest()


def _opened(journal: Path, identity: bytes, done: dict[int, Floats]) -> IO[bytes]:
    """The journal with its whole records, to append to."""
    temporary = journal.with_name(f"{journal.name}.{os.getpid()}.tmp")
    try:
        temporary.write_bytes(_HEAD + identity + b"".join(_bytes(k, v) for k, v in done.items()))
        temporary.replace(journal)
        return journal.open("ab")
    except OSError as error:
        raise OutputError(f"{journal}: cannot be written ({error.strerror or error}): give another place") from error


def _append(file: IO[bytes], index: int, value: Floats) -> None:
    file.write(_bytes(index, value))
    file.flush()
