"""What a value of a controller means to this program: the roles of registers, signals and objects."""

from __future__ import annotations

from enum import StrEnum
from typing import Final


class Way(StrEnum):
    """How a controller is given a motion."""

    STREAMED = "streamed"  # one set-point for each tick of its clock
    BUFFERED = "buffered"  # blocks of set-points into a buffer that it plays on its own clock
    GENERATOR = "generator"  # a function generator in the controller
    FILE = "file"  # a drive file, a start flag, a response file


class Role(StrEnum):
    """Meaning of one value. All values are in SI units after scale and offset."""

    # Read: state.
    TICK = "tick"  # counter of the controller's clock; it stops when the controller stops
    ENABLED = "enabled"
    RUNNING = "running"  # it follows set-points, plays its buffer, or its generator runs
    AT_REST = "at_rest"
    FAULTED = "faulted"
    FAULT_CODE = "fault_code"
    # Read: measured.
    POSITION = "position"
    FORCE = "force"
    CURRENT = "current"
    TEMPERATURE = "temperature"
    PRESSURE = "pressure"
    # Written: commands, each a bit or a word that is 1 or 0.
    ENABLE = "enable"
    START = "start"
    STOP = "stop"
    RESET = "reset"
    MOVE = "move"
    LOW_PRESSURE = "low_pressure"  # 1: the supply gives low pressure
    HOST_COUNTER = "host_counter"  # watched by the controller: it stops when this does not change
    # Written: set-points.
    TARGET = "target"  # of a positioning at low speed
    SETPOINT = "setpoint"
    CURRENT_SETPOINT = "current_setpoint"
    # Buffer of set-points.
    BUFFER_FREE = "buffer_free"
    BUFFER_TAKEN = "buffer_taken"  # number of the last block that was taken
    BUFFER_WINDOW = "buffer_window"
    BUFFER_CURRENT = "buffer_current"
    BUFFER_COUNT = "buffer_count"
    BUFFER_NUMBER = "buffer_number"  # written last: it hands the window over
    PLAYED = "played"
    # Store of measured samples.
    TRACE_FIRST = "trace_first"
    TRACE_COUNT = "trace_count"
    TRACE_POSITION = "trace_position"
    TRACE_FORCE = "trace_force"
    TRACE_CURRENT = "trace_current"
    TRACE_FETCHED = "trace_fetched"  # samples before this one may be dropped
    # Function generator.
    GENERATOR_SHAPE = "generator_shape"
    GENERATOR_AMPLITUDE = "generator_amplitude"
    GENERATOR_FREQUENCY = "generator_frequency"
    GENERATOR_CYCLES = "generator_cycles"
    GENERATOR_RAMP_CYCLES = "generator_ramp_cycles"
    # Channels of a measuring instrument, in windows.
    CHANNEL_1 = "channel_1"
    CHANNEL_2 = "channel_2"
    CHANNEL_3 = "channel_3"
    CHANNEL_4 = "channel_4"
    CHANNEL_5 = "channel_5"
    CHANNEL_6 = "channel_6"
    CHANNEL_7 = "channel_7"
    CHANNEL_8 = "channel_8"
    # Limits that the controller keeps itself.
    LIMIT_POSITION_MIN = "limit_position_min"
    LIMIT_POSITION_MAX = "limit_position_max"
    LIMIT_VELOCITY = "limit_velocity"
    LIMIT_FORCE = "limit_force"


MEASURED: Final = (Role.FORCE, Role.POSITION, Role.CURRENT, Role.TEMPERATURE, Role.PRESSURE)
"""Roles in the order of a captured sample."""

TRACE: Final = {Role.FORCE: Role.TRACE_FORCE, Role.POSITION: Role.TRACE_POSITION, Role.CURRENT: Role.TRACE_CURRENT}

STATE: Final = (Role.TICK, Role.ENABLED, Role.RUNNING, Role.AT_REST, Role.FAULTED)
ACTIONS: Final = (Role.ENABLE, Role.START, Role.STOP, Role.MOVE, Role.TARGET)
CHANNELS: Final = frozenset(role for role in Role if role.startswith("channel_"))
ARRAYS: Final = frozenset(
    {Role.BUFFER_WINDOW, Role.BUFFER_CURRENT, Role.TRACE_POSITION, Role.TRACE_FORCE, Role.TRACE_CURRENT, *CHANNELS}
)
_READ: Final = frozenset(
    {*STATE, *MEASURED, Role.FAULT_CODE, Role.BUFFER_FREE, Role.BUFFER_TAKEN, Role.PLAYED, Role.TRACE_FIRST}
    | {Role.TRACE_COUNT, *TRACE.values(), *CHANNELS}
)
WRITTEN: Final = frozenset(set(Role) - _READ)
"""Roles that the host writes; all others it reads."""

NEEDED: Final = {
    Way.STREAMED: (*STATE, *ACTIONS, Role.POSITION, Role.FORCE, Role.SETPOINT),
    Way.BUFFERED: (
        *(*STATE, *ACTIONS, Role.POSITION, Role.FORCE),
        *(Role.BUFFER_FREE, Role.BUFFER_TAKEN, Role.BUFFER_WINDOW, Role.BUFFER_COUNT, Role.BUFFER_NUMBER),
        *(Role.TRACE_FIRST, Role.TRACE_COUNT, Role.TRACE_POSITION, Role.TRACE_FORCE, Role.TRACE_FETCHED),
    ),
    Way.GENERATOR: (
        *(*STATE, *ACTIONS, Role.POSITION, Role.FORCE),
        *(Role.GENERATOR_SHAPE, Role.GENERATOR_AMPLITUDE, Role.GENERATOR_FREQUENCY, Role.GENERATOR_CYCLES),
        Role.PLAYED,
    ),
}
"""Roles that a map of registers or signals must have, by its way. A file console and a CANopen drive have
profiles of their own."""
