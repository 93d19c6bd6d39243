"""Faults and how each ends: one table, which the tests play row by row and the documentation shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from rigctl.device import FAULT_TEXT, HYDRAULIC, Fault, RigState
from sim_rig.detectors import DETECTORS

COMPLETE, ABORTED, TRUNCATED = "complete", "aborted", "truncated"


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRow:
    """One fault and how the run ends."""

    name: str
    order: str  # argument of `--fault`; empty where the host fails
    happens: str
    state: RigState  # of the rig at the end
    within_s: float  # from the fault until the rig is at rest; 0: the run continues
    file: str  # status of the run file
    reads: str  # part of the error message to the operator; empty: no error


def _stops(name: str, order: str, happens: str, fault: Fault, within_s: float, which: str = "") -> FaultRow:
    """Row of a fault that the rig detects: it stops, and the host reads why."""
    return FaultRow(
        name=name,
        order=order,
        happens=happens,
        state=RigState.FAULT_DISABLED,
        within_s=within_s,
        file=ABORTED,
        reads=FAULT_TEXT[fault] + which,
    )


def _goes_on(name: str, order: str, happens: str) -> FaultRow:
    return FaultRow(
        name=name, order=order, happens=happens, state=RigState.DISABLED, within_s=0.0, file=COMPLETE, reads=""
    )


def _sensors(kind: str, name: str, how: str, within_s: dict[str, float]) -> tuple[FaultRow, ...]:
    return tuple(
        _stops(
            f"{name} {sensor} sensor",
            f"sensor_{kind}@0.5:{sensor}",
            f"the {sensor} channel {how}; the rig decelerates to hold",
            Fault.SENSOR,
            seconds,
            f" ({sensor} sensor {'stuck' if kind == 'stuck' else 'out of range'})",
        )
        for sensor, seconds in within_s.items()
    )


QUICK: Final = dict.fromkeys(("force", "displacement", "current", "temperature"), 0.3)
FAULT_TABLE: Final = (
    _goes_on("lost frames", "lost:0.01", "1 % of all frames never arrive (classic CAN: 0.1 %); they are sent again"),
    _goes_on(
        "delayed frames",
        "delayed:0.02",
        "2 % of all frames (classic CAN: 0.2 %), and all frames after them, are 30 ms late",
    ),
    _goes_on("doubled frames", "doubled:0.05", "5 % of all frames arrive twice; the repetition changes nothing"),
    _goes_on("reordered frames", "reordered:0.02", "2 % of all frames are overtaken (classic CAN: 0.2 %)"),
    _goes_on(
        "corrupted frames",
        "corrupted:0.01",
        "a bit is flipped in 1 % of all frames (classic CAN: 0.1 %); checksums find it",
    ),
    _goes_on(
        "stalled server, short", "stalled@0.5:0.3", "the rig does not answer for 0.3 s and continues from its FIFO"
    ),
    FaultRow(
        name="stalled server, or a cut wire",
        order="stalled@0.5:60",
        happens="the rig does not answer any more; its watchdog decelerates it to hold",
        state=RigState.FAULT_HOLD,
        within_s=1.4,
        file=TRUNCATED,
        reads="the stop was not acknowledged",
    ),
    FaultRow(
        name="dead heartbeat of the rig",
        order="heartbeat@0.5",
        happens="the wire answers, but the controller's heartbeat has stopped; the host stops the rig",
        state=RigState.DISABLED,
        within_s=1.0,
        file=TRUNCATED,
        reads="the rig's heartbeat has stopped",
    ),
    FaultRow(
        name="dead heartbeat of the host",
        order="",
        happens="the host is silent for 2 s and comes back; the rig has decelerated to hold by then",
        state=RigState.FAULT_DISABLED,
        within_s=1.4,
        file=ABORTED,
        reads=FAULT_TEXT[Fault.HEARTBEAT],
    ),
    FaultRow(
        name="host killed (kill -9)",
        order="",
        happens="the rig decelerates to hold; `damper-rig recover` closes the file with every sample that was flushed",
        state=RigState.FAULT_HOLD,
        within_s=1.4,
        file=TRUNCATED,
        reads="",
    ),
    FaultRow(
        name="brown-out of the rig",
        order="brown_out@0.5:0.6",
        happens="the rig loses its power for 0.6 s and restarts disabled, without the state of the run",
        state=RigState.DISABLED,
        within_s=0.05,
        file=TRUNCATED,
        reads="the rig was restarted",
    ),
    _stops(
        "emergency stop",
        "emergency_stop@0.5",
        "the pressure is switched off at once; a reset has no effect while the button is pressed",
        Fault.EMERGENCY_STOP,
        0.05,
    ),
    _stops("pump trip", "pump_trip@0.5", "the supply pressure falls; power off", Fault.PRESSURE, 0.15),
    _stops(
        "over-temperature",
        "over_temperature@0.5",
        "the damper is 25 K above its limit for 0.5 s; the rig decelerates to hold",
        Fault.TEMPERATURE,
        0.9,
    ),
    _stops(
        "following error",
        "following_error@0.5",
        "the valve jams; the piston is further from its set-point than the limit for 20 ms",
        Fault.FOLLOWING_ERROR,
        0.4,
    ),
    *_sensors("stuck", "stuck", "does not change any more", {**QUICK, "temperature": 2.3}),
    *_sensors("saturated", "saturated", "reads full scale", QUICK),
    *_sensors("broken", "broken", "reads below its live zero: a broken cable", QUICK),
)


def as_markdown(rows: tuple[FaultRow, ...] = FAULT_TABLE) -> str:
    """The table for the documentation."""
    lines = ["| fault | `--fault` | what happens | nothing moves after | rig ends in | run file | the operator reads |"]
    lines.append("|---|---|---|---|---|---|---|")
    for row in rows:
        order = f"`{row.order}`" if row.order else "–"
        within = f"{row.within_s:g} s" if row.within_s else "goes on"
        reads = f"“{row.reads}”" if row.reads else "–"
        cells = (row.name, order, row.happens, within, row.state.name, row.file, reads)
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def detectors_as_markdown() -> str:
    """The rig's interlocks for the documentation: detector, delay, action."""
    lines = ["| detector | delay | action | the operator reads |", "|---|---|---|---|"]
    for one in DETECTORS:
        action = "pressure off" if one.fault & HYDRAULIC else "decelerate to hold"
        lines.append(f"| {one.name} | {1e3 * one.delay_s:g} ms | {action} | {FAULT_TEXT[one.fault]} |")
    return "\n".join(lines) + "\n"
