"""The samples that a rig plays, with the design that makes them again."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from excitation.errors import DesignError
from excitation.kinds import Kind

if TYPE_CHECKING:
    import plotly.graph_objects as go

__all__ = ["JSON", "Excitation", "Samples", "made_on_demand"]

JSON: TypeAlias = "bool | int | float | str | Sequence[JSON] | Mapping[str, JSON] | None"
Samples: TypeAlias = "Callable[[], NDArray[np.float64]]"
"""Makes the samples of one channel, (N,): the same at every call."""

_SLOWEST_HZ, _FASTEST_HZ = 1e-6, 1e9
"""Rates of samples that are no slip: 11 days between two samples; faster than any converter of a rig. Far beyond them
the derivatives of a motion are no numbers."""
_LARGEST = 1e9
"""Of a displacement, m or rad, and a current, A: no rig has a millionth of it, and its derivatives are numbers."""


def _frozen(name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    try:
        given = np.asarray(values)
        array = np.array(given, dtype=np.float64, order="C") if given.dtype.kind in "fiu" else None
    except (TypeError, ValueError):
        array = None
    if array is None:
        raise DesignError(f"{name} is {' '.join(repr(values).split()):.60}: it must be a 1-D array of real numbers")
    if array.ndim != 1 or array.size == 0:
        raise DesignError(f"{name} has shape {array.shape}: it must be a 1-D array with at least one sample")
    if not np.isfinite(array).all():
        first = int(np.flatnonzero(~np.isfinite(array))[0])
        raise DesignError(f"{name}: sample {first} is {array[first]}: every sample must be a finite number")
    if not -_LARGEST <= array.min() <= array.max() <= _LARGEST:
        raise DesignError(f"{name} reaches {np.abs(array).max():.3g}: it must stay within ±{_LARGEST:g}, in SI units")
    array.flags.writeable = False
    return array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Excitation:
    """Set-points on one uniform time base; the arrays are copies and read-only.

    ``period_samples`` is 0 where the signal is not periodic. ``design`` is the configuration that makes the
    same bytes again, ``figures`` what the design achieved (coverage, crest factor, binding limit …).
    """

    kind: Kind
    sample_rate_hz: float
    period_samples: int
    displacement_m: NDArray[np.float64]  # (N,)
    current_a: NDArray[np.float64] | None = None  # (N,); None for a passive damper
    design: Mapping[str, JSON] = field(default_factory=dict)
    figures: Mapping[str, JSON] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "displacement_m", _frozen("displacement", self.displacement_m))
        self._check_numbers()
        if self.current_a is not None:
            object.__setattr__(self, "current_a", _frozen("current", self.current_a))
            if self.current_a.size != self.samples:
                raise DesignError(
                    f"current has {self.current_a.size} samples and displacement {self.samples}: "
                    "both need the same number"
                )

    def _check_numbers(self) -> None:
        if self.kind not in tuple(Kind):
            raise DesignError(f"kind is {self.kind!r:.60}: it must be one of {', '.join(Kind)}")
        object.__setattr__(self, "kind", Kind(self.kind))
        if not isinstance(self.sample_rate_hz, int | float | np.integer | np.floating):
            raise DesignError(f"sample_rate is {self.sample_rate_hz!r:.60}: it must be a number, Hz")
        if not isinstance(self.period_samples, int | np.integer):
            raise DesignError(f"period_samples is {self.period_samples!r:.60}: it must be a whole number")
        if not _SLOWEST_HZ <= self.sample_rate_hz <= _FASTEST_HZ:
            raise DesignError(
                f"sample_rate is {self.sample_rate_hz} Hz: it must lie in {_SLOWEST_HZ:g} … {_FASTEST_HZ:g} Hz"
            )
        if not 0 <= self.period_samples <= self.samples:
            raise DesignError(
                f"period_samples is {self.period_samples}: it must lie in 0 … {self.samples}; 0: not periodic"
            )

    @property
    def samples(self) -> int:
        return int(self.displacement_m.size)

    @property
    def duration_s(self) -> float:
        return self.samples / self.sample_rate_hz

    @property
    def time_s(self) -> NDArray[np.float64]:
        """The instant of each sample, (N,), s, from 0."""
        return np.arange(self.samples) / self.sample_rate_hz

    @property
    def velocity_m_s(self) -> NDArray[np.float64]:
        """The derivative of the displacement, (N,), m/s, as ``excitation.motion`` takes it."""
        from excitation.motion import derivatives

        return derivatives(self)[0]

    @property
    def acceleration_m_s2(self) -> NDArray[np.float64]:
        """The second derivative of the displacement, (N,), m/s²."""
        from excitation.motion import derivatives

        return derivatives(self)[1]

    def plot(self) -> go.Figure:
        """Displacement, velocity, acceleration and current over time: one period, or all of what is not periodic."""
        from excitation.motion import motion
        from excitation.plots import signals_plot

        return signals_plot(motion(self))

    def with_figures(self, more: Mapping[str, JSON]) -> Excitation:
        """The same with more that its design achieved."""
        return replace(self, figures={**self.figures, **more})

    @property
    def sources(self) -> tuple[Samples, Samples | None] | None:
        """What makes displacement and current whenever they are read; None where the samples are kept."""
        return None

    def held(self) -> Excitation:
        """The same with its samples in memory: for who reads them block by block."""
        return replace(self)

    def __repr__(self) -> str:
        period = f", period {self.period_samples}" if self.period_samples else ""
        current = "" if self.current_a is None else ", with current"
        return (
            f"<{self.kind} excitation: {self.samples} samples at {self.sample_rate_hz:g} Hz, "
            f"{self.duration_s:.4g} s{period}{current}>"
        )


class _OnDemand(Excitation):
    """An excitation that makes its samples each time they are read, and keeps none: a plan of many stays small."""

    __slots__ = ("_current", "_displacement", "_samples")
    _samples: int
    _displacement: Samples
    _current: Samples | None

    def __new__(cls, **given: Any) -> Any:  # Any: the fields of Excitation
        """``dataclasses.replace`` gives arrays, which make an excitation that keeps them."""
        return object.__new__(cls) if "samples" in given else Excitation(**given)

    def __init__(self, *, samples: int, displacement_m: Samples, current_a: Samples | None, **said: Any) -> None:
        object.__setattr__(self, "_samples", samples)
        object.__setattr__(self, "_displacement", displacement_m)
        object.__setattr__(self, "_current", current_a)
        for name in ("kind", "sample_rate_hz", "period_samples", "design", "figures"):
            object.__setattr__(self, name, said[name])
        self._check_numbers()

    @property
    def samples(self) -> int:
        return self._samples

    @property
    def displacement_m(self) -> NDArray[np.float64]:
        return _frozen("displacement", self._displacement())

    @property
    def current_a(self) -> NDArray[np.float64] | None:
        return None if self._current is None else _frozen("current", self._current())

    @property
    def sources(self) -> tuple[Samples, Samples | None]:
        return self._displacement, self._current

    def with_figures(self, more: Mapping[str, JSON]) -> Excitation:
        said = {**self._said(), "figures": {**self.figures, **more}}
        return _on_demand(self._samples, self._displacement, self._current, said)

    def _said(self) -> dict[str, Any]:
        """What is stated beside the samples. Any: the fields of Excitation."""
        return {name: getattr(self, name) for name in ("kind", "sample_rate_hz", "period_samples", "design", "figures")}

    def __reduce__(self) -> Any:
        """Any: as pickle has it."""
        return _on_demand, (self._samples, self._displacement, self._current, self._said())


def _on_demand(samples: int, displacement_m: Samples, current_a: Samples | None, said: Mapping[str, Any]) -> Excitation:
    made: Excitation = _OnDemand(samples=samples, displacement_m=displacement_m, current_a=current_a, **said)
    return made


def made_on_demand(
    *,
    kind: Kind,
    sample_rate_hz: float,
    period_samples: int,
    samples: int,
    displacement_m: Samples,
    current_a: Samples | None = None,
    design: Mapping[str, JSON],
    figures: Mapping[str, JSON] | None = None,
    checked: bool = False,
) -> Excitation:
    """An excitation whose samples are made whenever they are read; made once here, if they are not ``checked`` yet.

    Raises DesignError where they are not ``samples`` finite numbers.
    """
    said = {"kind": kind, "sample_rate_hz": sample_rate_hz, "period_samples": period_samples}
    made = _on_demand(samples, displacement_m, current_a, {**said, "design": design, "figures": figures or {}})
    for name in () if checked else ("displacement", "current"):
        values = made.displacement_m if name == "displacement" else made.current_a
        if values is not None and values.size != samples:
            raise DesignError(f"{name} has {values.size} samples: it must have {samples}")
    return made
