"""Where the data of an HDF5 file lie, what its compressed chunks unpack to, and how long its texts are.

Deflate packs up to 1 : 1030, and HDF5 unpacks a chunk to its end, however long that is. So every compressed chunk is
first unpacked here into no more than its declared size.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator
from math import prod
from typing import Any, Final

import numpy as np
from h5py import Dataset, h5z

from excitation.errors import ExcitationFileError
from excitation.untrusted.limits import MOST_TEXT_BYTES
from excitation.untrusted.structure import Structure

__all__ = ["check_places", "check_texts"]

_CHECKSUM: Final = 4  # bytes that fletcher32 adds before compression
_PIECE: Final = 1 << 20


def check_places(found: Structure, handle: int, file_bytes: int) -> list[tuple[int, int]]:
    """First byte and last + 1 of every piece of data.

    Raise ExcitationFileError where data lie outside of the file, or a chunk unpacks to more than it declares.
    """
    places = []
    for where, dataset in found.contiguous:
        offset, size = dataset.get_offset(), dataset.get_storage_size()
        if offset is None or not size:
            continue
        places.append((offset, offset + size))
        if offset + size > file_bytes:
            raise ExcitationFileError(f"{where}: damaged: its data end at byte {offset + size} of {file_bytes}")
    for where, dataset in found.chunked:
        places += _check_chunks(where, dataset, handle, file_bytes)
    return places


def _check_chunks(where: str, dataset: Any, handle: int, file_bytes: int) -> list[tuple[int, int]]:
    # Any, here and below: h5py has no types
    properties = dataset.get_create_plist()
    filters = [properties.get_filter(k)[0] for k in range(properties.get_nfilters())]
    most = prod(properties.get_chunk()) * dataset.get_type().get_size()
    stored: list[Any] = []
    dataset.chunk_iter(stored.append)
    for chunk in stored:
        if not 0 <= chunk.byte_offset <= file_bytes - chunk.size:
            raise ExcitationFileError(f"{where}: damaged: a chunk of {chunk.size} bytes lies outside of the file")
        if not filters and chunk.size != most:
            raise ExcitationFileError(f"{where}: damaged: a chunk of {chunk.size} bytes: {most} are due")
        if h5z.FILTER_DEFLATE in filters and not chunk.filter_mask >> filters.index(h5z.FILTER_DEFLATE) & 1:
            _check_unpacked(where, handle, chunk, most + _CHECKSUM)
    return [(chunk.byte_offset, chunk.byte_offset + chunk.size) for chunk in stored]


def _check_unpacked(where: str, handle: int, chunk: Any, most: int) -> None:
    unpacking, unpacked, start = zlib.decompressobj(), 0, 0
    while not unpacking.eof and (start < chunk.size or unpacking.unconsumed_tail):
        packed = unpacking.unconsumed_tail
        if not packed:
            packed = os.pread(handle, min(_PIECE, chunk.size - start), chunk.byte_offset + start)
            start += _PIECE
        try:
            unpacked += len(unpacking.decompress(packed, _PIECE))
        except zlib.error as error:
            raise ExcitationFileError(f"{where}: damaged: a chunk cannot be unpacked ({error})") from error
        if unpacked > most:
            raise ExcitationFileError(f"{where}: a chunk unpacks to more than its {most - _CHECKSUM} bytes: it may not")


def check_texts(found: Structure) -> None:
    """Raise ExcitationFileError where the texts of variable length are too long together; each is read alone."""
    total = 0
    for where, text in _texts(found):
        total += len(text) if isinstance(text, bytes | str) else 0
        if total > MOST_TEXT_BYTES:
            raise ExcitationFileError(f"{where}: {total} bytes of text in all: at most {MOST_TEXT_BYTES} are read")


def _texts(found: Structure) -> Iterator[tuple[str, object]]:
    for where, attribute in found.text_attributes:
        if attribute.get_space().get_simple_extent_npoints() == 1:
            value = np.empty(attribute.shape, dtype=attribute.dtype)
            attribute.read(value)
            yield where, value.reshape(-1)[0]
    for where, identity in found.texts:
        dataset = Dataset(identity)
        for index in np.ndindex(dataset.shape or (0,)):
            yield where, dataset[index]
