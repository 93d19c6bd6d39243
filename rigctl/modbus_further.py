"""Channels of further axes over Modbus: windows of input registers that follow the block exchange.

Window k holds the channels of the captured samples 5·k … 5·k + 4 that are not acknowledged yet, 32 bits each; the four
windows reach as far as the read window of the block exchange. Reading changes nothing: a window may be read again.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl import scaling
from rigctl.further_axes import FURTHER_AXES
from rigctl.modbus_map import CAPTURE_SAMPLES, Block, Register, crc32
from rigctl.packing import from_counts, to_counts
from rigctl.transport import CaptureBlock

SAMPLES: Final = 5  # in a window: 20 words each, and a read returns at most 125
_LAYOUT: Final = np.dtype([(name, ">i4") for name in FURTHER_AXES])
_WORDS: Final = 2 * len(FURTHER_AXES)


def _header(address: int) -> Block:
    return Block(
        address=address,
        count=6,
        registers=(
            Register(name="first_index", address=address, type="u32"),
            Register(name="samples", address=address + 2),
            Register(name="run_id", address=address + 3),
            Register(name="crc", address=address + 4, type="u32"),
        ),
    )


HEADERS: Final = tuple(_header(0x400 + 0x80 * k) for k in range(-(-CAPTURE_SAMPLES // SAMPLES)))
COUNT: Final = 6 + SAMPLES * _WORDS


def encode_further(window: int, capture: CaptureBlock) -> list[int]:
    """Words of a window; `capture` holds all channels, (n, 15), of the samples that are not acknowledged."""
    part = slice(SAMPLES * window, SAMPLES * (window + 1))
    rows = to_counts(capture.values[part, -len(FURTHER_AXES) :], _LAYOUT, scaling.FURTHER)
    body: list[int] = rows.view(">u2").tolist()
    head = {"first_index": capture.first_index + part.start, "samples": rows.size, "run_id": capture.run_id, "crc": 0}
    words = HEADERS[window].encode(head)
    words[-2:] = divmod(crc32([*words, *body]), 1 << 16)
    return [*words, *body, *[0] * (COUNT - len(words) - len(body))]


def decode_further(window: int, words: Sequence[int]) -> CaptureBlock | None:
    """The channels of further axes, (n, 10), in a window; None where it is damaged."""
    header = HEADERS[window]
    head = header.decode(words[: header.count])
    count = int(head["samples"])
    body = list(words[header.count : header.count + count * _WORDS])
    if len(body) != count * _WORDS or crc32([*words[: header.count - 2], 0, 0, *body]) != head["crc"]:
        return None
    rows: NDArray[np.float64] = from_counts(np.array(body, dtype=">u2").view(_LAYOUT), scaling.FURTHER)
    return CaptureBlock(run_id=int(head["run_id"]), first_index=int(head["first_index"]), values=rows)


def with_further(capture: CaptureBlock, windows: Sequence[CaptureBlock | None]) -> CaptureBlock | None:
    """A captured block, (n, 5), with the channels of its windows, (n, 15); None where they are not of its samples."""
    rows, expected = [np.empty((0, len(FURTHER_AXES)))], capture.first_index
    for one in windows:
        if one is None or one.run_id != capture.run_id or one.first_index != expected:
            return None
        expected += SAMPLES
        rows.append(one.values)
    further = np.concatenate(rows)[: capture.samples]
    if further.shape[0] != capture.samples:
        return None
    return CaptureBlock(
        run_id=capture.run_id, first_index=capture.first_index, values=np.hstack([capture.values, further])
    )
