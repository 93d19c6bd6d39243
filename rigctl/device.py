"""States, control word and fault word of the rig, after CiA 408."""

from __future__ import annotations

from enum import Enum, IntFlag


class RigState(Enum):
    """State of the device; the value is the status word's bits D, H, M, R (R: ready, no fault)."""

    INIT = 0b1000
    DISABLED = 0b1001
    HOLD = 0b1011
    ACTIVE = 0b1111
    FAULT_DISABLED = 0b0001
    FAULT_HOLD = 0b0011
    FAULT_REACTION = 0b0111

    @property
    def moving(self) -> bool:
        """Whether the actuator may be following a trajectory."""
        return self in (RigState.ACTIVE, RigState.FAULT_REACTION)

    @property
    def faulted(self) -> bool:
        """Whether a fault is latched, until a reset."""
        return self in (RigState.FAULT_DISABLED, RigState.FAULT_HOLD, RigState.FAULT_REACTION)


SAFE_STATES = frozenset({RigState.INIT, RigState.DISABLED, RigState.HOLD, RigState.FAULT_DISABLED, RigState.FAULT_HOLD})


class PressureStage(Enum):
    """Supply pressure of the actuator."""

    OFF = 0
    LOW = 1  # for hands near the rig: little force, little speed, and motion only while somebody asks for it
    HIGH = 2  # for a test


class Control(IntFlag):
    """Bits of the control word."""

    NOTHING = 0
    D = 1
    H = 2
    M = 4
    RESET = 8

    DISABLE = D
    HOLD = D | H
    ACTIVATE = D | H | M


class Fault(IntFlag):
    """Bits of the fault word: why the rig stopped on its own."""

    NONE = 0
    UNDERFLOW = 1
    HEARTBEAT = 2
    POSITION_LIMIT = 4
    VELOCITY_LIMIT = 8
    POSITION_JUMP = 16
    FORCE_LIMIT = 32
    FOLLOWING_ERROR = 64
    TEMPERATURE = 128
    PRESSURE = 256
    CAPTURE_OVERRUN = 512
    EMERGENCY_STOP = 1024
    CURRENT_LIMIT = 2048
    SENSOR = 4096
    SETPOINT = 8192
    FOREIGN = 16384


SENSORS = ("force", "displacement", "current", "temperature")
DETECTORS = (  # detectors of a rig, by the number in its status; 0: none has acted
    "",
    *(f"{sensor} sensor out of range" for sensor in SENSORS),
    *(f"{sensor} sensor stuck" for sensor in SENSORS),
    *("position", "velocity", "force", "following error", "temperature", "supply pressure"),
)

HYDRAULIC = Fault.EMERGENCY_STOP | Fault.PRESSURE
"""Faults that switch the pressure off; every other one stops the motion with the pressure on."""

FAULT_TEXT = {
    Fault.UNDERFLOW: "the set-points ran out before the end of the stream",
    Fault.HEARTBEAT: "the host's heartbeat was lost",
    Fault.POSITION_LIMIT: "the position limit was reached",
    Fault.VELOCITY_LIMIT: "the velocity limit was reached",
    Fault.POSITION_JUMP: "a set-point jumped further than the limits of velocity and acceleration allow in one sample",
    Fault.FORCE_LIMIT: "the force limit was reached",
    Fault.FOLLOWING_ERROR: "the actuator did not follow its set-point",
    Fault.TEMPERATURE: "the damper is too hot",
    Fault.PRESSURE: "the supply pressure failed",
    Fault.CAPTURE_OVERRUN: "captured samples were not collected in time",
    Fault.EMERGENCY_STOP: "the emergency stop was pressed",
    Fault.CURRENT_LIMIT: "a current set-point lies outside its limits",
    Fault.SENSOR: "a sensor is stuck, saturated or broken",
    Fault.SETPOINT: "a set-point lies outside the position limits",
    Fault.FOREIGN: "the controller reports a fault that its map does not name",
}


def describe(faults: Fault, detector: int = 0) -> str:
    """Return in words what a fault word contains, with the detector; empty where it is 0."""
    text = "; ".join(text for fault, text in FAULT_TEXT.items() if fault in faults)
    return f"{text} ({DETECTORS[detector]})" if Fault.SENSOR in faults and 0 < detector < len(DETECTORS) else text
