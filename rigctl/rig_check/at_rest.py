"""The part of a rig check without power: what the rig says, how fast it answers, whether it keeps its word."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rigctl.axis import UNPOWERED
from rigctl.clock import Clock
from rigctl.errors import IdentityError, LimitError, RequestDenied
from rigctl.limits import Configuration
from rigctl.procedures.station import Station, commanded
from rigctl.rig_check.masters import one_master
from rigctl.rig_check.protocol import Finding, Protocol, Verdict, noted
from rigctl.rig_check.told import identity_told, limits_told, state_told
from rigctl.transport import Capability, Identity, Transport
from rigctl.wire_rate import CALL_S, largest_rate_hz, round_trips_s

__all__ = ["check_at_rest"]

ROUND_TRIPS: Final = 200
CLOCK_S: Final = 3.0  # a jitter of 5 ms over this time is an uncertainty of about 400 ppm
CLOCK_PPM: Final = 500.0  # a quartz is within 100 ppm; more is a wrong sample rate
LOOK_S: Final = 0.01
GOLDEN: Final = 0.618034  # looks at shares k·GOLDEN of a tick are spread evenly over it, so its rounding averages out
WIDER: Final = 1.1  # of the machine's limit of speed: a rig must refuse it


def check_at_rest(
    transport: Transport, another: Callable[[], Transport], clock: Clock, *, operator: str = ""
) -> Protocol:
    """Walk the rig without power: identity, limits, readings, round trips, clocks, master, refusals, stop.

    `another` connects once more, as a second host would. Of a controller of another make the walk does what its map
    allows, and says what is not known.

    Raises
    ------
    RigError
        When the rig cannot be commanded: another host has it, or a fault is latched.
    """
    with commanded(transport, clock) as station:
        identity = station.identity
        found = [*identity_told(identity), *limits_told(identity), *state_told(identity, station.axis.status())]
        trips = np.array(round_trips_s(transport, clock, ROUND_TRIPS))
        found += _round_trips(trips, identity, min(transport.block_samples, transport.capture_samples))
        found += _clocks(station, transport)
        if identity.foreign:
            found += _left_to_its_map()
        else:
            found.append(one_master(another, clock))
            found += _refusals(transport, identity)
        found += _stop(transport, clock)
    return Protocol(
        url=transport.url,
        made_at=datetime.now(UTC).isoformat(timespec="seconds"),
        identity=identity,
        findings=tuple(found),
        round_trips_s=trips,
        operator=operator,
    )


def _round_trips(trips: NDArray[np.float64], identity: Identity, samples: int) -> list[Finding]:
    half, most, worst = (float(np.quantile(trips, share)) for share in (0.5, 0.95, 0.99))
    carried = (
        f"not known: its map says how it is driven; one tick of its clock is {1e3 / identity.sample_rate_max_hz:g} ms"
        if identity.foreign
        else f"{largest_rate_hz(half, samples):.0f} Hz"
    )
    return [
        Finding(
            part="wire",
            what=f"round trip of {trips.size} exchanges: median, 95 %, 99 %, longest",
            found=f"{1e3 * half:.2f}, {1e3 * most:.2f}, {1e3 * worst:.2f}, {1e3 * float(trips.max()):.2f} ms",
            verdict=Verdict.GOOD if worst < CALL_S else Verdict.BAD,
            wanted=f"99 % below {1e3 * CALL_S:g} ms",
        ),
        noted("wire", "rate that it carries", carried),
    ]


def _clocks(station: Station, transport: Transport) -> list[Finding]:
    """The rig's sample clock against this computer's, and whether its heartbeat counts."""
    clock, rate = station.clock, station.rate_hz
    at, counted, beats = list[float](), list[int](), set[int]()
    began = clock.now()
    while clock.now() - began < CLOCK_S:
        before = clock.now()
        status = transport.status(CALL_S)
        at.append((before + clock.now()) / 2)
        counted.append(status.sample_index)
        beats.add(status.heartbeat)
        clock.sleep(LOOK_S + GOLDEN * len(at) % 1.0 / rate)
    (slope, _), spread = np.polyfit(np.array(at) - at[0], np.array(counted) - counted[0], 1, cov=True)
    ppm, uncertainty = 1e6 * (float(slope) / rate - 1), 1e6 * float(np.sqrt(spread[0, 0])) / rate
    beating = Finding(
        part="clocks",
        what="heartbeat of the rig",
        found=f"{len(beats)} values in {CLOCK_S:g} s",
        verdict=Verdict.GOOD if len(beats) > 1 else Verdict.BAD,
        wanted="it counts",
    )
    if Capability.SIMULATED in station.identity.capabilities and abs(ppm) > 1e5:
        return [beating, noted("clocks", "sample clock", "of a simulation")]
    near = abs(ppm) <= CLOCK_PPM + 2 * uncertainty
    return [
        beating,
        Finding(
            part="clocks",
            what=f"sample clock at {rate:g} Hz against this computer's",
            found=f"{ppm:+.0f} ppm, uncertain by {uncertainty:.0f} ppm",
            verdict=Verdict.GOOD if near else Verdict.BAD,
            wanted=f"within {CLOCK_PPM:g} ppm",
        ),
    ]


def _left_to_its_map() -> list[Finding]:
    """What a controller of another make cannot be asked without power."""
    return [
        noted("one master", "a second host wants to command", "not known without power: it has no sessions"),
        noted("refusals", "wrong configurations", "not known: its protocol has none that it would have to refuse"),
    ]


def _refusals(transport: Transport, identity: Identity) -> list[Finding]:
    """Whether the rig refuses a configuration that its identity does not allow."""
    limits = identity.limits
    asked = {
        "limits wider than the machine's": Configuration(
            limits=replace(limits, velocity_m_s=WIDER * limits.velocity_m_s)
        ),
        "a sample rate above its own": Configuration(
            sample_rate_hz=round(WIDER * identity.sample_rate_max_hz), limits=limits
        ),
        "a watchdog of a minute": Configuration(heartbeat_s=60.0, limits=limits),
    }
    return [
        Finding(
            part="refusals",
            what=what,
            found="refused" if (refused := _refuses(transport, configuration)) else "accepted",
            verdict=Verdict.GOOD if refused else Verdict.BAD,
            wanted="refused",
        )
        for what, configuration in asked.items()
    ]


def _refuses(transport: Transport, configuration: Configuration) -> bool:
    try:
        transport.configure(configuration, CALL_S)
    except (RequestDenied, IdentityError, LimitError):
        return True
    return False


def _stop(transport: Transport, clock: Clock) -> list[Finding]:
    began = clock.now()
    status = transport.stop(CALL_S)
    return [
        Finding(
            part="stop",
            what="a stop is acknowledged without power",
            found=f"{1e3 * (clock.now() - began):.1f} ms, {status.state.name}",
            verdict=Verdict.GOOD if status.state in UNPOWERED else Verdict.BAD,
            wanted="it stays without power",
        )
    ]
