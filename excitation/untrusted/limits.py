"""What a file from elsewhere may hold at most: every number with its derivation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = [
    "FREE_BYTES",
    "MOST_ATTRIBUTES",
    "MOST_ATTRIBUTE_BYTES",
    "MOST_CHUNKS",
    "MOST_CHUNK_BYTES",
    "MOST_DEPTH",
    "MOST_OBJECTS",
    "MOST_PACKED_RATIO",
    "MOST_PLAIN_RATIO",
    "MOST_RANK",
    "MOST_TEXTS",
    "MOST_TEXT_BYTES",
    "Limits",
]

# A plan of 500 tests, the most that a campaign takes, has 2 groups and 2 channels for each: 2 000 objects.
MOST_OBJECTS: Final = 10_000
MOST_DEPTH: Final = 8  # groups in groups; evidence.h5, our deepest, has 4
MOST_ATTRIBUTES: Final = 200  # of one object; a run with every optional attribute has some 30
MOST_ATTRIBUTE_BYTES: Final = 1 << 20  # of numbers or fixed texts; HDF5 itself keeps 64 kB in an object's header
# Of all texts of variable length. A design came in the body of a request, at most 4 MiB; with escapes (\uXXXX) it takes
# three times as much.
MOST_TEXT_BYTES: Final = 16 << 20
MOST_TEXTS: Final = 10_000  # of variable length in a file, each looked at once: 0.2 s; a run has some 100 events
MOST_RANK: Final = 3  # channels have 1, the maps of a report 2

# h5py chooses chunks of up to 1 MiB; a whole channel of 25 min at 5 kHz in one chunk has 60 MB.
MOST_CHUNK_BYTES: Final = 64 << 20
# HDF5 takes some 0.5 kB for each chunk of a channel that it reads whole. An hour of 12 channels at 5 kHz in our chunks
# of 4 096 samples has 53 000.
MOST_CHUNKS: Final = 200_000

# A million values are free: every channel of a short run may be constant, and a constant packs to almost nothing.
FREE_BYTES: Final = 8 << 20
# Of a file without compression: two measured channels beside 18 that were never written (they read as zero).
MOST_PLAIN_RATIO: Final = 10
# Deflate packs a constant 1 : 1030. One of 20 channels is measured with 12 bits of noise or more, 1.5 of 8 bytes:
# 20 · 8 / 1.5 = 107.
MOST_PACKED_RATIO: Final = 107


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What one kind of file may hold."""

    # All datasets in memory, a number as float64. 4 GiB: two hours of 14 channels at 5 kHz are 4.0 GB.
    most_bytes: int = 4 << 30
    booleans: bool = False  # whether h5py's boolean type is one of this kind's types
