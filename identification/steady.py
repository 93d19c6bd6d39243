"""Steady sine tests: whole cycles, their harmonics, dynamic stiffness, loss factor and loop shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.derivatives import periodic_kinematics
from identification.errors import DataError
from identification.period import with_period_seen
from identification.smoothing import smooth_kinematics
from rigctl.runfile import Run

Floats = NDArray[np.float64]

_HARMONICS = 25
_LOBE = 2  # lines on either side of a sine's own over which Hann's window spreads it
_LEAST_SHARE = 0.8  # of a steady sine's power there: (1 − _PURE)/1.16 with four harmonics of a fifth of its amplitude
_PURE = 0.03  # largest share of the displacement's power outside of its first five harmonics
_LEAST_CYCLES = 2
_CLEAR = 6.0  # times the median of the upper harmonics: a harmonic above the noise
_LEAST_SAMPLES = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycles:
    """Whole steady cycles of one test; arrays (N,), SI.

    `x_lines` and `f_lines` are complex amplitudes of displacement and force at the multiples of `frequency_hz`, the
    first entry the mean: s(t) = Re Σ S_k exp(2πi k f t), t from the first sample.
    """

    name: str
    frequency_hz: float
    t: Floats
    x: Floats
    v: Floats
    force: Floats
    x_lines: NDArray[np.complex128]
    f_lines: NDArray[np.complex128]
    current: float | None

    @property
    def amplitude_m(self) -> float:
        """Amplitude of the displacement's first harmonic, m."""
        return float(abs(self.x_lines[1]))

    @property
    def peak_velocity_m_s(self) -> float:
        """Velocity amplitude of the first harmonic, m/s."""
        return 2.0 * np.pi * self.frequency_hz * self.amplitude_m

    @property
    def stiffness(self) -> complex:
        """H = F/X at the first harmonic, N/m: real part stores, imaginary part dissipates."""
        return complex(self.f_lines[1] / self.x_lines[1])

    def loop(self, points: int = 400) -> tuple[Floats, Floats, Floats]:
        """Displacement, velocity and force of one cycle from its harmonics, (points,) each.

        Lanczos factors keep the force from ringing where it jumps, over that of the first harmonic: it stays as it is,
        however few harmonics the sample rate has room for.
        """
        t = np.arange(points) / (points * self.frequency_hz)
        return *self.motion(t), _wave(t, _faded(self.f_lines), self.frequency_hz)

    def motion(self, t: Floats) -> tuple[Floats, Floats]:
        """Displacement and velocity at the times `t`, s, from the harmonics of the displacement.

        Those count that stand out of its noise, which the velocity would amplify.
        """
        k = np.arange(self.x_lines.size)
        noise = np.median(np.abs(self.x_lines[(k.size + 1) // 2 :]))
        lines = np.where((k < 2) | (np.abs(self.x_lines) > _CLEAR * noise), self.x_lines, 0.0)
        rate = 2j * np.pi * self.frequency_hz * k
        return _wave(t, lines, self.frequency_hz), _wave(t, rate * lines, self.frequency_hz)


def dynamic_stiffness(cycles: Cycles) -> float:
    """K_d = |F/X| at the first harmonic, N/m."""
    return abs(cycles.stiffness)


def loss_factor(cycles: Cycles) -> float:
    """tan φ = Im H/Re H at the first harmonic; large where the damper stores little energy."""
    return float(cycles.stiffness.imag / cycles.stiffness.real) if cycles.stiffness.real != 0.0 else np.inf


def energy_per_cycle(cycles: Cycles) -> float:
    """∮F dx = π Σ k |X_k||F_k| sin φ_k, J: under a pure sine the first harmonic alone."""
    k = np.arange(cycles.x_lines.size)
    return float(np.pi * np.sum(k * (cycles.f_lines * np.conj(cycles.x_lines)).imag))


def loop_shape(cycles: Cycles) -> float:
    """Fullness of the force–displacement loop against an ellipse: 2|F_1|/(F_max − F_min).

    Under a sine the area of a loop depends on its first harmonic alone. The share A/(Δx·ΔF) of its bounding rectangle
    that it fills, the relative energy dissipation of ACI 374.1 (2005) for a rigid–plastic reference, is (π/4)·sin φ
    times this figure. The loss angle has a criterion of its own, so it is taken out: 1 is an ellipse (linear), 4/π a
    rectangle (dry friction, a saturated valve), below 1 a peaked loop (orifice, end stop). Insensitive to noise in
    phase and scale, which the area itself is not.
    """
    return float(shape_of(cycles.f_lines))


def shape_of(f_lines: NDArray[np.complex128], points: int = 400) -> Floats:
    """The `loop_shape` of forces from their complex amplitudes (…, K + 1) at the multiples of the frequency, (…)."""
    turn = np.outer(np.arange(points), np.arange(f_lines.shape[-1])) / points
    force = (_faded(f_lines) @ np.exp(2j * np.pi * turn).T).real
    return np.asarray(2.0 * np.abs(f_lines[..., 1]) / np.ptp(force, axis=-1))


def _faded(lines: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """The amplitudes (…, K + 1) with Lanczos factors, over that of the first harmonic."""
    k = np.arange(lines.shape[-1])
    return np.where(k > 0, np.sinc(k / k.size) / np.sinc(1.0 / k.size), 1.0) * lines


def steady_cycles(run: Run, channel: str = "force") -> Cycles | None:
    """The steady whole cycles of a sine test; None where the motion is not a sine or the force is constant.

    The first period of a periodic run, or the first cycle of another, is transient and left out. Where amplitude or
    frequency wander, the longest stretch counts in which they do not: a half, quarter or eighth of the run, of several
    the purest. Raises DataError where the displacement or the channel is missing.
    """
    name = run.path.name if run.path is not None else run.run_id
    for needed in ("displacement", channel):
        if needed not in run.channels:
            raise DataError(f"{name}: no channel '{needed}': a loop needs displacement and force")
    run = with_period_seen(run).run
    x, force, rate = run.channels["displacement"], run.channels[channel], run.sample_rate_hz
    if x.size < _LEAST_SAMPLES or np.ptp(x) == 0.0 or np.ptp(force) == 0.0:
        return None
    stretch = _whole_periods(run) if _periodic(run) else _steadiest(x, rate)
    if stretch is None:
        return None
    keep, frequency = stretch
    t = np.arange(keep.stop - keep.start) / rate
    order = max(1, int(min(_HARMONICS, 0.45 * rate / frequency)))
    current = run.channels.get("current")
    return Cycles(
        name=name,
        frequency_hz=frequency,
        t=t,
        x=x[keep],
        v=_velocity(run)[keep],
        force=force[keep],
        x_lines=_lines(t, x[keep], frequency, order),
        f_lines=_lines(t, force[keep], frequency, order),
        current=None if current is None else float(np.mean(current[keep])),
    )


def _steadiest(x: Floats, rate: float) -> tuple[slice, float] | None:
    """The longest pure stretch of whole cycles and its frequency, Hz."""
    for parts in (1, 2, 4, 8):
        length = x.size // parts
        starts = range(0, x.size - length + 1, max(1, length // 2))
        found = [_sine(x, slice(start, start + length), rate) for start in starts]
        pure = [f for f in found if f is not None and f[2] < _PURE]
        if pure:
            keep, frequency, _ = min(pure, key=lambda f: f[2])
            return keep, frequency
    return None


def _sine(x: Floats, part: slice, rate: float) -> tuple[slice, float, float] | None:
    """Whole cycles of a part of the displacement, their frequency, and the share of power outside of its harmonics."""
    frequency = _frequency(x[part], rate)
    if frequency is None:
        return None
    cycle = rate / frequency
    start = part.start + (round(cycle) if part.start == 0 else 0)  # a start from rest is transient
    count = int((part.stop - start) / cycle + 1e-6)
    if count < _LEAST_CYCLES:
        return None
    keep = slice(start, start + round(count * cycle))
    return keep, frequency, _impurity(x[keep], frequency, rate)


def _impurity(x: Floats, frequency: float, rate: float) -> float:
    t = np.arange(x.size) / rate
    lines = _lines(t, x, frequency, 5)
    if abs(lines[1]) < 5.0 * float(np.max(np.abs(lines[2:]))):
        return 1.0
    return float(np.mean((x - _wave(t, lines, frequency)) ** 2) / np.mean((x - x.mean()) ** 2))


def _whole_periods(run: Run) -> tuple[slice, float] | None:
    """All settled periods of a periodic run and the frequency of their strongest line, if that is all they hold."""
    n, period = run.samples, run.period_samples
    keep = slice(period, n // period * period)
    x = run.channels["displacement"][keep]
    mean = x.reshape(-1, period).mean(axis=0)
    frequency = float(np.argmax(np.abs(np.fft.rfft(mean - mean.mean())))) * run.sample_rate_hz / period
    return (keep, frequency) if _impurity(x, frequency, run.sample_rate_hz) < _PURE else None


def _periodic(run: Run) -> bool:
    return run.period_samples >= 8 and run.samples >= 3 * run.period_samples


def _velocity(run: Run) -> Floats:
    x = run.channels["displacement"]
    if not _periodic(run):
        return smooth_kinematics(x, run.sample_rate_hz).v
    count = run.samples // run.period_samples
    period = periodic_kinematics(x[: count * run.period_samples].reshape(count, -1)[1:], run.sample_rate_hz).v
    return np.resize(period, x.size)


def _frequency(x: Floats, rate: float) -> float | None:
    """Frequency of the strongest line, Hz, by least squares around it."""
    from scipy.optimize import minimize_scalar  # 0.3 s to import: only where a run does not repeat

    n = x.size
    power = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(n))) ** 2
    k = int(np.argmax(power))
    if k < _LEAST_CYCLES or np.sum(power[max(k - _LOBE, 0) : k + _LOBE + 1]) < _LEAST_SHARE * np.sum(power):
        return None
    t = np.arange(n) / rate

    def misfit(f: float) -> float:
        return float(np.sum((x - _wave(t, _lines(t, x, f, 3), f)) ** 2))

    found = minimize_scalar(misfit, bounds=((k - 0.7) * rate / n, (k + 0.7) * rate / n), method="bounded",
                            options={"xatol": 1e-7 * rate / n})  # fmt: skip
    return float(found.x)


def _lines(t: Floats, s: Floats, frequency: float, order: int) -> NDArray[np.complex128]:
    """Complex amplitudes at the multiples of the frequency by least squares, (order + 1,)."""
    angle = 2.0 * np.pi * frequency * np.outer(t, np.arange(1, order + 1))
    basis = np.concatenate([np.ones((t.size, 1)), np.cos(angle), np.sin(angle)], axis=1)
    found = np.linalg.solve(basis.T @ basis, basis.T @ s)  # its columns are all but orthogonal
    return np.concatenate([found[:1] + 0j, found[1 : order + 1] - 1j * found[order + 1 :]])


def _wave(t: Floats, lines: NDArray[np.complexfloating[Any, Any]], frequency: float) -> Floats:
    return np.asarray((np.exp(2j * np.pi * frequency * np.outer(t, np.arange(lines.size))) @ lines).real)
