"""The inputs of a model: motion, current and temperature of one run on its time base."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.models.series import between, is_constant

Floats = NDArray[np.float64]
_SERIES = ("x", "v", "a", "i", "temperature", "t")

# SI, of any input: what is larger is no measurement of a damper. Half or double: nothing, machines lie far below.
LARGEST_INPUT = 1e6


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Inputs of a model, each (N,) float64, SI.

    `period` is the number of samples after which x, v, a and i repeat exactly, 0 where they don't: then a shift in time
    is exact to rounding, else it interpolates with the derivatives at hand. After `settle` periods a damper's response
    to such a motion repeats too, and needs no further simulation. `remanence` in −1 … 1 is what the current before the
    first sample left in a magnetic circuit with hysteresis: −1 when it came from far below, 1 from far above. No more
    than `ahead` periods are simulated before the one that repeats: fewer for a quick look.
    """

    dt: float
    x: Floats
    v: Floats
    a: Floats
    i: Floats
    temperature: Floats
    t: Floats
    period: int = 0
    settle: int = 0
    remanence: float = 0.0
    ahead: float = np.inf

    def head(self, samples: int) -> Motion:
        """The first samples of the motion."""
        return replace(self, **{name: getattr(self, name)[:samples] for name in _SERIES})

    def held(self) -> Motion:
        """The motion with the last good value wherever an input is no number, infinite or beyond any machine."""
        x, v, a, i, temperature = (
            held(one, largest=LARGEST_INPUT) for one in (self.x, self.v, self.a, self.i, self.temperature)
        )
        return replace(self, x=x, v=v, a=a, i=i, temperature=temperature)

    def one_period(self, warm: int) -> Motion:
        """One period of a periodic motion, of which one at least is there, after the `warm` samples before it."""
        if warm not in self._periods:
            series: dict[str, Any] = {name: _ending(getattr(self, name)[: self.period], warm) for name in _SERIES}
            self._periods[warm] = replace(self, **series)
        return self._periods[warm]

    @cached_property
    def _periods(self) -> dict[int, Motion]:
        """What `one_period` has made: every step of a fit asks again."""
        return {}

    @cached_property
    def fastest(self) -> float:
        """Its highest speed, m/s; 0 without a sample."""
        return float(np.max(np.abs(self.v), initial=0.0))

    def __getstate__(self) -> dict[str, Any]:
        """What another process is sent: the inputs, and nothing that follows from them."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def shifted(self, tau: float) -> Motion:
        """The inputs as they were `tau` seconds ago, or will be in −`tau`; beyond the samples the nearest is held."""
        if tau == 0.0:
            return self
        if self.period:
            x, v, a = self._lines_shifted(tau)
        else:
            shifted = np.empty((3, self.x.size))
            between(self.x, self.v, self.a, tau / self.dt, self.dt, shifted)
            x, v, a = shifted
        return replace(
            self,
            x=x,
            v=v,
            a=a,
            i=delayed(self.i, tau, self.dt, periodic=self.period),
            temperature=self.temperature
            if is_constant(self.temperature)
            else np.interp(self.t - tau, self.t, self.temperature),
            t=self.t - tau,
        )

    @cached_property
    def _lines(self) -> NDArray[np.complex128]:
        """Spectra of one period of x, v and a, (3, L): every step of a fit shifts the motions of its records again."""
        return np.fft.rfft(np.array([self.x, self.v, self.a])[:, : self.period])

    def _lines_shifted(self, tau: float) -> list[Floats]:
        """x, v and a of a motion that repeats, (N,) each, `tau` seconds ago."""
        turn = np.exp(-2j * np.pi * np.arange(self._lines.shape[1]) * tau / (self.period * self.dt))
        if self.period % 2 == 0:
            turn[-1] = turn[-1].real
        return [repeated(one, self.x.size) for one in np.fft.irfft(self._lines * turn, self.period)]


def repeated(period: Floats, samples: int) -> Floats:
    """So many samples of what repeats after a `period` (P,) or (P, K) of samples, from its beginning on."""
    whole, rest = divmod(samples, period.shape[0])
    return np.concatenate([*[period] * whole, period[:rest]])


def _ending(period: Floats, warm: int) -> Floats:
    """A period (P,), after `warm` samples of those like it before."""
    whole, rest = divmod(warm, period.size)
    return np.concatenate([period[period.size - rest :], *[period] * (whole + 1)]) if warm else period


def held(values: Floats, first: float | None = None, *, largest: float = np.inf) -> Floats:
    """A series (N,) with its last good value wherever it is not finite, or larger than `largest`.

    What comes before the first good value is `first`, or that value; 0 where there is none.
    """
    good = np.isfinite(values) & (np.abs(np.where(np.isfinite(values), values, 0.0)) <= largest)
    if good.all():
        return values
    if first is None:
        first = float(values[np.argmax(good)]) if good.any() else 0.0
    last = np.maximum.accumulate(np.where(good, np.arange(values.size), -1))
    return np.where(last < 0, first, values[np.maximum(last, 0)])


def is_step(i: Floats) -> NDArray[np.bool_]:
    """Where the current jumps from one sample to the next, (N − 1,): a held step, not a slope.

    A jump is a step when it is more than a fifth of the range: a band-limited signal that is sampled at all well takes
    at least ten samples from end to end.
    """
    span = float(np.ptp(i))
    return np.abs(np.diff(i)) > 0.2 * span if span > 0 else np.zeros(i.size - 1, dtype=np.bool_)


def delayed(i: Floats, tau: float, dt: float, periodic: int = 0) -> Floats:
    """The current `tau` seconds ago, (N,): interpolated where it is smooth, held where it steps."""
    if is_constant(i):
        return i
    position = np.arange(i.size) - tau / dt
    if periodic:
        i, position = np.concatenate([i[:periodic], i[:1]]), position % periodic
    position = np.clip(position, 0.0, i.size - 1.0)
    left = np.minimum(np.floor(position + 1e-9).astype(np.int64), i.size - 2)
    q = np.clip(position - left, 0.0, 1.0)
    q = np.where(is_step(i)[left] & (q < 1.0 - 1e-9), 0.0, q)
    out: Floats = i[left] + q * (i[left + 1] - i[left])
    return out
