"""Reference dampers by name, and the rig's plant with one of them in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from sim_rig.multi_axis import ANTI_YAW, MultiAxisSpecimen
from sim_rig.parameters import ARCTAN, BILINEAR, HYPERBOLIC, VALVE, Damper
from sim_rig.sensors import Noise


@dataclass(frozen=True, slots=True, kw_only=True)
class Specimen:
    """One reference damper: its true parameters, what it is tested with, and its load cell's noise."""

    name: str
    text: str
    damper: Damper
    stroke_m: float  # peak displacement of a typical test
    speed_m_s: float
    force_rms_n: float  # in a typical test: scale of hidden effects and noise
    current_a: tuple[float, float] | None = None

    @property
    def noise(self) -> Noise:
        return Noise(force_n=0.01 * self.force_rms_n)


SEMI_ACTIVE = Specimen(
    name="semi-active",
    text="electro-hydraulic semi-active damper with a proportional valve, 0.3 … 1.6 A",
    damper=Damper(
        base=VALVE,
        c_soft=1500.0,
        c_firm=6500.0,
        u_soft=0.3,
        u_firm=1.6,
        knee=0.45,
        hysteresis=150.0,
        hysteresis_control=80.0,
        hysteresis_slope=25.0,
        hysteresis_shift=0.4,
        mount=2.5e6,
        mount_c=400.0,
        lag=0.012,
        heat_capacity=160.0,
        cooling=4.0,
        scale_m=0.03,
        scale_m_s=0.5,
    ),
    stroke_m=0.05,
    speed_m_s=1.0,
    force_rms_n=1000.0,
    current_a=(0.3, 1.6),
)
PASSIVE = Specimen(
    name="passive",
    text="passive hydraulic damper with a blow-off valve",
    damper=Damper(
        base=ARCTAN,
        f1=900.0,
        slope=9.0,
        c=1400.0,
        heat_capacity=150.0,
        cooling=3.6,
        scale_m=0.03,
        scale_m_s=0.5,
    ),
    stroke_m=0.05,
    speed_m_s=1.0,
    force_rms_n=900.0,
)
YAW = Specimen(
    name="yaw",
    text="railway yaw damper, an enriched Maxwell model",
    damper=Damper(
        base=ARCTAN,
        f1=8000.0,
        slope=60.0,
        c=9000.0,
        mount=6.15e6,
        mount_branch=3e7,
        mount_branch_c=6e3,
        heat_capacity=360.0,
        cooling=9.0,
        scale_m=0.01,
        scale_m_s=0.1,
    ),
    stroke_m=0.02,
    speed_m_s=0.25,
    force_rms_n=6000.0,
)
RAILWAY = Specimen(
    name="railway",
    text="railway oil damper with rubber bushes",
    damper=Damper(
        base=BILINEAR,
        f1=7603.0,
        c=2.305e6,
        c2=1.684e5,
        mount=2.457e6,
        mount_c=500.0,
        heat_capacity=80.0,
        cooling=2.0,
        scale_m=0.005,
        scale_m_s=0.03,
    ),
    stroke_m=0.015,
    speed_m_s=0.07,
    force_rms_n=8000.0,
)
MR = Specimen(
    name="mr",
    text="magneto-rheological seat damper",
    damper=Damper(
        base=HYPERBOLIC,
        c=977.0,
        c_control=1496.0,
        hysteresis=87.0,
        hysteresis_control=1022.0,
        hysteresis_slope=30.0,
        hysteresis_shift=0.7,
        stiffness=20.8,
        preload=-88.8,
        heat_capacity=60.0,
        cooling=1.5,
        scale_m=0.02,
        scale_m_s=0.2,
    ),
    stroke_m=0.02,
    speed_m_s=0.4,
    force_rms_n=550.0,
    current_a=(0.0, 1.0),
)
MR_DISTORTION = Specimen(
    name="mr-distortion",
    text="magneto-rheological damper whose force lags after each reversal",
    damper=MR.damper._replace(distortion=0.0016, distortion_control=0.0, stiffness=900.0, preload=-60.0),
    stroke_m=0.02,
    speed_m_s=0.3,
    force_rms_n=500.0,
    current_a=(0.0, 1.0),
)
MR_SEAT = replace(
    MR,
    name="mr-seat",
    text="magneto-rheological seat damper whose loop depends on current and recent peak speed",
    damper=MR.damper._replace(
        c=976.7,
        c_control=1496.2,
        hysteresis=86.56,
        hysteresis_control=1016.4,
        hysteresis_slope=21.3,
        hysteresis_at=0.3,
        hysteresis_power=-0.8621,
        hysteresis_rise=0.0866,
        hysteresis_fall=0.285,
        hysteresis_shift=0.4354,
        hysteresis_shift_control=0.5472,
        preload=-88.79,
        peak_time=1.5,
    ),
)
SPECIMENS: Mapping[str, Specimen] = {
    specimen.name: specimen for specimen in (SEMI_ACTIVE, PASSIVE, YAW, RAILWAY, MR, MR_DISTORTION, MR_SEAT)
}
MULTI_AXIS: Mapping[str, tuple[MultiAxisSpecimen, Specimen]] = {"anti-yaw": (ANTI_YAW, RAILWAY)}
"""Specimens of six axes, each with the one of a single axis that loads the actuator in its place."""
