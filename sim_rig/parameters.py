"""The parameters of a specimen, and of everything that can be hidden in it."""

from __future__ import annotations

from typing import Final, NamedTuple

VALVE: Final = 0
ARCTAN: Final = 1
BILINEAR: Final = 2
HYPERBOLIC: Final = 3


class Damper(NamedTuple):
    """Parameters of one specimen, SI. Zero switches an effect off."""

    base: int = VALVE
    # What the specimen is by design.
    c_soft: float = 0.0
    c_firm: float = 0.0
    u_soft: float = 0.0
    u_firm: float = 1.0
    knee: float = 1.0
    f1: float = 0.0
    slope: float = 1.0
    c: float = 0.0
    c2: float = 0.0
    c_control: float = 0.0
    hysteresis: float = 0.0
    hysteresis_control: float = 0.0
    hysteresis_slope: float = 1.0
    hysteresis_shift: float = 0.0
    hysteresis_shift_control: float = 0.0
    hysteresis_power: float = 0.0  # exponent of recent peak speed over hysteresis_at in the slope of the loop
    hysteresis_at: float = 1.0
    hysteresis_rise: float = 0.0  # share by which the force grows with that speed, s/m
    hysteresis_fall: float = 0.0  # and falls with its square, s²/m²
    peak_time: float = 0.4  # time constant of the recent peak speed, s
    preload: float = 0.0
    stiffness: float = 0.0
    mount: float = 0.0  # 0: rigid
    mount_c: float = 0.0
    mount_branch: float = 0.0  # a further spring, in series with mount_branch_c, parallel to the mount
    mount_branch_c: float = 1.0
    lag: float = 0.0
    distortion: float = 0.0  # travel after a reversal until the force is back, m
    distortion_control: float = 0.0
    # What can be hidden in it, by the names of the catalogue.
    viscous: float = 0.0
    viscous_control: float = 0.0
    arctan_force: float = 0.0
    arctan_slope: float = 1.0
    bilinear_c: float = 0.0
    bilinear_force: float = 1.0
    valve_soft: float = 0.0
    valve_firm: float = 0.0
    valve_knee: float = 1.0
    quadratic: float = 0.0
    relief: float = 0.0
    relief_knee: float = 1.0
    asymmetry: float = 0.0
    tanh_force: float = 0.0
    tanh_slope: float = 1.0
    tanh_shift: float = 0.0
    loop_force: float = 0.0
    loop_travel: float = 1.0
    coulomb: float = 0.0
    stribeck: float = 0.0
    stribeck_rise: float = 0.0
    stribeck_speed: float = 1.0
    presliding: float = 0.0
    presliding_travel: float = 1.0
    linear: float = 0.0
    cubic: float = 0.0
    gas: float = 0.0
    gas_length: float = 1.0
    gas_exponent: float = 1.3
    stop: float = 0.0
    stop_at: float = 1.0
    position: float = 0.0
    fade: float = 0.0
    reversal: float = 0.0
    play: float = 0.0
    delay: float = 0.0
    saturation: float = 0.0
    hysteresis_width: float = 0.0
    force_delay: float = 0.0
    offset: float = 0.0
    mass: float = 0.0
    drift: float = 0.0
    hum: float = 0.0
    hum_frequency: float = 50.0
    # What can be hidden in it and is not in the catalogue.
    leak_stiffness: float = 0.0
    leak_time: float = 1.0
    patch: float = 0.0
    patch_at: float = 0.0
    patch_width: float = 1.0
    cavitation: float = 0.0
    cavitation_speed: float = 1.0
    cavitation_time: float = 1.0
    backlash: float = 0.0
    amplitude: float = 0.0
    amplitude_speed: float = 1.0
    # Heat.
    heat_capacity: float = 4000.0
    cooling: float = 15.0
    ambient: float = 22.0
    scale_m: float = 0.02  # typical stroke, speed: scale of the departures from linear
    scale_m_s: float = 0.5
