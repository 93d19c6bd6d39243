"""Value of one count on the wire, for the frames, their DBC and the registers."""

from __future__ import annotations

from typing import Final

DISPLACEMENT_M: Final = 1e-7
FORCE_N: Final = 0.1
CURRENT_A: Final = 1e-4
TEMPERATURE_DEGC: Final = 0.1
PRESSURE_PA: Final = 1e4
ROTATION_RAD: Final = 1e-6
TORQUE_NM: Final = 1e-2
VELOCITY_M_S: Final = 1e-4
ACCELERATION_M_S2: Final = 1e-2
SAMPLE_RATE_HZ: Final = 0.1
TIME_S: Final = 1e-3

SETPOINT: Final = (DISPLACEMENT_M, CURRENT_A)
CAPTURE: Final = (FORCE_N, DISPLACEMENT_M, CURRENT_A, TEMPERATURE_DEGC, PRESSURE_PA)
FURTHER: Final = (*2 * (DISPLACEMENT_M,), *3 * (ROTATION_RAD,), *2 * (FORCE_N,), *3 * (TORQUE_NM,))
"""Of the channels of further axes, in the order of `rigctl.further_axes.FURTHER_AXES`."""
