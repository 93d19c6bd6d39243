"""What a machine is made of: the numbers of its organs, in one flat vector for the compiled simulation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Values = Mapping[str, float]

# Zero switches an organ off, except where a number other than zero stands in PLAIN.
NAMES = (
    # oil between two chambers, rebound and compression: areas, laminar gaps, ports behind them, shim stacks, blow-off
    "area_r", "area_c", "bleed_r", "bleed_c", "port_r", "port_c", "shim_at_r", "shim_at_c", "shim_r", "shim_c",
    "blow_at_r", "blow_at_c", "blow_r", "blow_c", "shim_round",
    # oil that yields: pressure for a volume, free air and its pressure, length of a chamber, suction
    "elastance", "air", "air_at", "dead_length", "suction",
    # coil and spool of a controlled valve: how firm at which current
    "firm", "firm_at", "firm_width",
    # gas behind the rod: force, length, exponent of a fast change, time of heat exchange
    "gas_force", "gas_length", "gas_exponent", "gas_time",
    # seals and guides: sliding force, travel before, rise at rest and its speed, bias of direction
    "rub", "rub_travel", "rub_rise", "rub_speed", "rub_bias",
    # a second friction with a long travel: rubber on itself, a bellows, leaf on leaf
    "slip", "slip_travel",
    # guide film and air drag
    "film", "drag", "film_bias",
    # springs: linear, progressive with its length; buffers at both ends
    "spring", "rise", "rise_length", "buffer", "buffer_at", "buffer_length", "buffer_one_side",
    # losses that depend on place, on temperature, on heat that no thermometer sees
    "groove", "groove_length", "thin", "hot", "hot_time",
    # magnetic gap: yield at rest, with current, its rounding
    "yield_0", "yield_i", "yield_speed",
    # coil: rise, fall, saturation, remanence, delay of the driver
    "coil_rise", "coil_fall", "coil_sat", "coil_play", "driver_delay",
    # moving mass
    "mass",
    # in series: rubber or oil column, its loss, a joint with play
    "bush", "bush_loss", "play",
    # what no element of the catalogue means: tooth passing, rubber with a power law in time, a kick of the coil
    "cog", "cog_pitch", "power_law", "power_order", "kick", "kick_time",
)  # fmt: skip
AT = {name: number for number, name in enumerate(NAMES)}
PLAIN = {
    "shim_round": 0.15, "air_at": 1e5, "gas_length": 1.0, "gas_exponent": 1.35, "gas_time": 3.0, "rub_travel": 2e-5,
    "rub_speed": 0.01, "slip_travel": 1e-3, "rise_length": 1.0, "buffer_length": 0.01, "groove_length": 0.1,
    "hot_time": 10.0, "yield_speed": 0.02, "firm_width": 1.0, "cog_pitch": 0.01, "power_order": 0.3, "kick_time": 0.02,
}  # fmt: skip


def vector(values: Values) -> NDArray[np.float64]:
    """All numbers of a machine, (len(NAMES),); what is not given is PLAIN, else 0. An unknown one raises KeyError."""
    out = np.zeros(len(NAMES))
    for name, value in {**PLAIN, **values}.items():
        out[AT[name]] = value
    return out
