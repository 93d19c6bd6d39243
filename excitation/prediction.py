"""What a test will ask of the rig and do to the damper, before it is played."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from excitation.kinds import Kind
from excitation.motion import BAND_LIMITED, Motion, motion
from excitation.rig import Envelope, Hydraulics, Specimen
from excitation.signal import Excitation

__all__ = ["ForceModel", "Prediction", "predict", "specimen_force"]

ForceModel: TypeAlias = Callable[[Motion], NDArray[np.float64]]
"""Force in N, (N,), positive in tension, over the samples of a motion."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """Peaks and sums over one test; None where the envelope lacks the data to predict it."""

    displacement_m: float
    velocity_m_s: float
    acceleration_m_s2: float
    highest_frequency_hz: float
    lowest_current_a: float | None
    highest_current_a: float | None
    force_n: float | None
    energy_j: float | None  # dissipated in the damper during the whole test
    power_w: float | None  # mean
    temperature_rise_k: float | None  # of the damper, from ambient, by the end of the test
    valve_flow_share: float | None  # largest flow over the flow that the valve passes at that load; 1: saturated
    peak_flow_m3_s: float | None
    mean_flow_m3_s: float | None
    accumulator_m3: float | None  # oil that the accumulator must supply
    duration_s: float


def predict(excitation: Excitation, envelope: Envelope, force_model: ForceModel | None = None) -> Prediction:
    """Predicted load of one test; the force comes from ``force_model``, else from the envelope's specimen."""
    moved = motion(excitation)
    force = specimen_force(moved, envelope.specimen, force_model)
    energy = None if force is None else _energy(moved, force)
    oil = envelope.hydraulics
    flow = None if oil is None else oil.piston_area_m2 * np.abs(moved.velocity_m_s)
    currents = moved.current_a
    return Prediction(
        displacement_m=_peak(moved.displacement_m),
        velocity_m_s=_peak(moved.velocity_m_s),
        acceleration_m_s2=_peak(moved.acceleration_m_s2),
        highest_frequency_hz=_highest_frequency(excitation, moved),
        lowest_current_a=None if currents is None else float(currents.min()),
        highest_current_a=None if currents is None else float(currents.max()),
        force_n=None if force is None else _peak(force),
        energy_j=energy,
        power_w=None if energy is None else energy / excitation.duration_s,
        temperature_rise_k=_temperature_rise(energy, excitation.duration_s, envelope.specimen),
        valve_flow_share=None if oil is None or flow is None else _valve_share(moved, flow, force, oil),
        peak_flow_m3_s=None if flow is None else float(flow.max()),
        mean_flow_m3_s=None if flow is None else float(flow.mean()),
        accumulator_m3=None if oil is None or flow is None else _accumulator_oil(flow, oil.pump_flow_m3_s, moved),
        duration_s=excitation.duration_s,
    )


def _peak(values: NDArray[np.float64]) -> float:
    return float(np.abs(values).max())


def specimen_force(
    moved: Motion, specimen: Specimen | None, force_model: ForceModel | None
) -> NDArray[np.float64] | None:
    """Force in N, (N,), from the model, else from the specimen; None with neither."""
    if force_model is not None:
        return force_model(moved)
    if specimen is None:
        return None
    current = 0.0 if moved.current_a is None else moved.current_a
    damping = specimen.damping_n_s_m + specimen.damping_control * current
    return np.asarray(damping * moved.velocity_m_s + specimen.friction_n * np.sign(moved.velocity_m_s))


def _energy(moved: Motion, force: NDArray[np.float64]) -> float:
    return float(np.sum(force * moved.velocity_m_s)) / moved.sample_rate_hz * moved.repeats


def _temperature_rise(energy: float | None, duration_s: float, specimen: Specimen | None) -> float | None:
    """ΔT = P/h·(1 − exp(−h·t/C)), which is E/C without cooling (h = 0)."""
    if energy is None or specimen is None or specimen.heat_capacity_j_k is None:
        return None
    capacity, cooling = specimen.heat_capacity_j_k, specimen.cooling_w_k
    if cooling == 0.0:
        return energy / capacity
    return float(energy / duration_s / cooling * -np.expm1(-cooling * duration_s / capacity))


def _valve_share(moved: Motion, flow: NDArray[np.float64], force: NDArray[np.float64] | None, oil: Hydraulics) -> float:
    """Flow over rated_flow·sqrt(Δp/rated drop), Δp = supply − return − force/area while the force opposes the
    motion;
    infinite where the load uses all the pressure."""
    against = 0.0 if force is None else np.maximum(0.0, force * np.sign(moved.velocity_m_s)) / oil.piston_area_m2
    drop = np.maximum(0.0, oil.supply_pressure_pa - oil.return_pressure_pa - against)
    passes = oil.valve_rated_flow_m3_s * np.sqrt(drop / oil.valve_rated_pressure_drop_pa) + np.zeros_like(flow)
    share = np.divide(flow, passes, out=np.full_like(flow, np.inf), where=passes > 0)
    return float(np.where(flow > 0, share, 0.0).max())


def _accumulator_oil(flow: NDArray[np.float64], pump_flow_m3_s: float, moved: Motion) -> float:
    """The largest oil deficit: demand beyond the pump accumulates, the surplus of the pump refills, up to
    full.

    Two periods show it where the pump refills within one; where it does not, every further period adds its
    deficit.
    """
    shortfall = (flow - pump_flow_m3_s) / moved.sample_rate_hz
    level = np.concatenate([[0.0], np.cumsum(np.tile(shortfall, 2 if moved.repeats >= 2 else 1))])
    deficit = float((level - np.minimum.accumulate(level)).max())
    return deficit + max(0.0, float(shortfall.sum())) * max(0.0, moved.repeats - 2.0)


def _highest_frequency(excitation: Excitation, moved: Motion) -> float:
    """The highest line with more than 1e-6 of the strongest line's amplitude; of a triangle its repetition rate, of a
    sweep its highest frequency.
    """
    if excitation.kind is Kind.TRIANGLE and excitation.period_samples:
        return _repetition_rate(excitation, moved)
    ends = [excitation.design.get(key) for key in ("f_start", "f_end")]
    if excitation.kind is Kind.SWEEP and all(isinstance(end, (int, float)) for end in ends):
        return max(float(str(end)) for end in ends)
    values, threshold = moved.displacement_m, 1e-6
    if not excitation.period_samples and excitation.kind not in BAND_LIMITED:
        values, threshold = _windowed(values), 1e-3
    amplitude = np.abs(np.fft.rfft(values))
    amplitude[0] = 0.0
    strong = np.flatnonzero(amplitude > threshold * max(float(amplitude.max()), 1e-300))
    highest = int(strong[-1]) if strong.size else 0
    return highest * excitation.sample_rate_hz / moved.displacement_m.size


def _windowed(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The values minus the line through their ends, times a Hann window: against leakage of a signal that is not
    periodic.
    """
    line = np.linspace(values[0], values[-1], values.size)
    return np.asarray((values - line) * np.sin(np.pi * (np.arange(values.size) + 0.5) / values.size) ** 2)


def _repetition_rate(excitation: Excitation, moved: Motion) -> float:
    """Of a triangle, of which several cycles may be one period: that of the strongest line, Hz."""
    cycles = int(np.argmax(np.abs(np.fft.rfft(moved.displacement_m))[1:])) + 1
    return cycles * excitation.sample_rate_hz / excitation.period_samples
