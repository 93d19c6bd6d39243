"""The sample rate that a wire can carry, from round trips measured before anything moves."""

from __future__ import annotations

from contextlib import suppress
from statistics import median
from typing import Final

from rigctl.clock import Clock
from rigctl.errors import LimitError, TransportError
from rigctl.transport import Capability, Identity, Transport

__all__ = ["SHARE", "check_wire", "largest_rate_hz", "round_trips_s"]

SHARE: Final = 0.8  # of what the wire carries: the rest is for repeated blocks, statuses and a computer that is late
FEW: Final = 5  # round trips that decide where the wire is fast enough
MANY: Final = 25  # where it seems not to be: a busy computer may have delayed the first
CALL_S: Final = 0.25
NO_RUN: Final = 0  # runs are numbered from 1: what is counted for the next one must not begin before it is open
REAL_TIME: Final = (0.5, 2.0)  # speed of a clock that does not wait for its host, relative to this computer's


def largest_rate_hz(round_trip_s: float, samples: int) -> float:
    """The sample rate that exchanges can carry: SHARE · samples of an exchange / round trip.

    One exchange is under way at a time. It brings a block of set-points and takes captured samples away, so the smaller
    of the two decides. Median and not mean: the buffers of the rig level out single late answers, and nothing levels
    out a wire that is too slow.
    """
    return SHARE * samples / round_trip_s if round_trip_s > 0 else float("inf")


def round_trips_s(transport: Transport, clock: Clock, count: int) -> list[float]:
    """Measure exchanges without a block; those without an answer count as long as they were waited for."""
    found = []
    for _ in range(count):
        began = clock.now()
        try:
            transport.exchange(None, NO_RUN, 0, CALL_S)
        except TransportError:
            found.append(CALL_S)
        else:
            found.append(clock.now() - began)
    return found


def check_wire(transport: Transport, clock: Clock, identity: Identity, rate_hz: float) -> None:
    """Refuse a rate that the wire cannot carry, with the one that it can: LimitError.

    The rig is configured and at rest. A simulated rig whose clock waits for the host can be fed at any rate.
    """
    samples = min(transport.block_samples, transport.capture_samples)
    if samples <= 1:
        return  # a foreign controller; its map says how it is driven
    measured = round_trips_s(transport, clock, FEW)
    if rate_hz <= largest_rate_hz(median(measured), samples):
        return
    before, began = _sample_index(transport), clock.now()
    measured += round_trips_s(transport, clock, MANY)
    played, passed = _sample_index(transport) - before, clock.now() - began
    slow, fast = (speed * rate_hz * passed for speed in REAL_TIME)
    if Capability.SIMULATED in identity.capabilities and not slow <= played <= fast:
        return
    largest = largest_rate_hz(median(measured), samples)
    if rate_hz > largest:
        raise LimitError(
            f"{transport.url}: sample_rate is {rate_hz:g} Hz, this wire carries {_round_down(largest):g} Hz: "
            f"a round trip takes {1e3 * median(measured):.1f} ms and brings {samples} samples; "
            "design the test at that rate, or use a faster wire"
        )


def _sample_index(transport: Transport) -> int:
    """The rig's sample index; asked again where the answer was lost."""
    for _ in range(FEW):
        with suppress(TransportError):
            return transport.status(CALL_S).sample_index
    return transport.status(CALL_S).sample_index


def _round_down(rate_hz: float) -> float:
    """Two digits, not above: within what was measured, and easy to type."""
    digits = f"{rate_hz:.1e}"
    rounded = float(digits)
    return rounded if rounded <= rate_hz else rounded - 10.0 ** int(digits[-3:]) / 10
