"""What a periodic run played: the numbers that tell one level from another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.analysis import excited_in
from excitation.analysis.spectra import power_between, rms_lines
from rigctl.runfile import Run

__all__ = ["PICK_UP_A", "Setting", "periods_of", "same_current", "setting_of"]

Floats = NDArray[np.float64]
Lines = NDArray[np.int64]

# Rms of the current's mean period below which it rests: coils take tenths of an ampere to amperes, a sensor picks up
# less than this.
PICK_UP_A = 0.01
# Difference of held currents within which they are one: amplifiers and their sensors are off by 1 to 3 %, plans step by
# a tenth of an ampere or more. A tenth mixes levels; a third of it takes repetitions apart.
_HELD_A, _HELD_SHARE = 0.03, 0.05
_SHOWN_A = 4  # digits of a mean current after the point: a tenth of a milliampere is less than any sensor tells
# Share of the lines of two runs that are common: those at the end of a steep spectrum may differ.
_SAME_LINES = 0.9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Setting:
    """Rate, period, rms inputs without their means, held current and driven lines."""

    sample_rate_hz: float
    period_samples: int
    displacement_rms_m: float
    velocity_rms_m_s: float
    current_rms_a: float  # 0: it rests, or is not measured
    current_mean_a: float | None  # None: not measured
    lines: tuple[Lines, ...]  # of the displacement, and of the current where it moves

    def is_like(self, other: Setting, ratio: float) -> bool:
        """Whether both are of one design, their rms inputs within ``ratio``, their mean currents the same."""
        if (self.sample_rate_hz, self.period_samples) != (other.sample_rate_hz, other.period_samples):
            return False
        moving = min(self.current_rms_a, other.current_rms_a)
        if len(self.lines) != len(other.lines) or not same_current(self.current_mean_a, other.current_mean_a, moving):
            return False
        pairs = (
            (self.displacement_rms_m, other.displacement_rms_m),
            (self.current_rms_a, other.current_rms_a),
        )
        if any(max(pair) > ratio * min(pair) for pair in pairs):
            return False
        return all(_same_lines(*lines) for lines in zip(self.lines, other.lines, strict=True))

    @property
    def text(self) -> str:
        """The level in words."""
        motion = f"{1e3 * self.displacement_rms_m:.3g} mm and {self.velocity_rms_m_s:.3g} m/s rms"
        if self.current_mean_a is None:
            return motion
        moving = f" ± {self.current_rms_a:.2g} A rms" if self.current_rms_a else " A"
        mean = round(self.current_mean_a, _SHOWN_A) + 0.0  # no −0, and no rounding of a sum over a period
        return f"{motion}, {mean:.3g}{moving}"


def same_current(one: float | None, other: float | None, moving_rms_a: float = 0.0) -> bool:
    """Whether two mean currents, A, are one setting; of currents that move, within a quarter of their rms."""
    if one is None or other is None:
        return one is other
    return abs(one - other) <= max(_HELD_A, _HELD_SHARE * max(abs(one), abs(other)), 0.25 * moving_rms_a)


def setting_of(run: Run) -> Setting:
    """What a run of whole periods played, from the mean over its periods, of several without the first."""
    motion, current = periods_of(run, "displacement"), None
    spectrum = _mean_lines(motion)
    omega = 2.0 * np.pi * run.sample_rate_hz / run.period_samples * np.arange(spectrum.size)
    lines, level, mean = [_driven(motion)], 0.0, None
    if "current" in run.channels:
        current = periods_of(run, "current")
        mean = float(_later(current).mean())
        level = _rms(_mean_lines(current))
        if level > PICK_UP_A:
            lines.append(_driven(current))
        else:
            level = 0.0
    return Setting(
        sample_rate_hz=run.sample_rate_hz,
        period_samples=run.period_samples,
        displacement_rms_m=_rms(spectrum),
        velocity_rms_m_s=_rms(spectrum * omega),
        current_rms_a=level,
        current_mean_a=mean,
        lines=tuple(lines),
    )


def periods_of(run: Run, channel: str) -> Floats:
    """The whole periods of a channel, (P, N)."""
    count = run.samples // run.period_samples
    return run.channels[channel][: count * run.period_samples].reshape(count, run.period_samples)


def _later(periods: Floats) -> Floats:
    return periods[1:] if len(periods) > 1 else periods


def _mean_lines(periods: Floats) -> NDArray[np.complex128]:
    return rms_lines(_later(periods).mean(axis=0))


def _rms(lines: NDArray[np.complex128]) -> float:
    """Without the mean."""
    return float(np.sqrt(np.sum(np.abs(lines[1:]) ** 2)))


def _driven(periods: Floats) -> Lines:
    each = rms_lines(_later(periods))
    return excited_in(np.abs(each.mean(axis=0)) ** 2, power_between(each) / len(each))


def _same_lines(one: Lines, other: Lines) -> bool:
    return np.intersect1d(one, other).size >= _SAME_LINES * max(one.size, other.size)
