"""What a multisine configuration says: the keys of CONFIG.toml."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from excitation.checks import check_above, check_at_least, check_one_of, check_within
from excitation.configuration import STRICT
from excitation.errors import DesignError
from excitation.force_estimate import ForceEstimate
from excitation.lines import LineChoice
from excitation.region import Variable
from excitation.response import RigResponse
from excitation.spectra import QuarterCar, RecordSpectrum, Road, TableSpectrum

__all__ = ["CurrentSpec", "DisplacementSpec", "HomogeniseSpec", "MultisineSpec", "Variable"]

_MOST_SAMPLES = 2**24  # 2^24 float64 samples are 134 MB a channel: more is a typing error
_MOST_CELLS = 100_000


def _check_band(f_min_hz: float, f_max_hz: float) -> None:
    check_above("f_min", f_min_hz, 0.0, "Hz")
    if f_max_hz <= f_min_hz:
        raise DesignError(f"f_max is {f_max_hz:g} Hz: it must be above f_min ({f_min_hz:g} Hz)")


@dataclass(frozen=True, slots=True, kw_only=True)
class DisplacementSpec:
    """Band, lines, spectrum and limits of the displacement."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    f_min_hz: float
    f_max_hz: float
    max_displacement_m: float
    max_velocity_m_s: float
    max_acceleration_m_s2: float | None = None
    lines: LineChoice = "all"
    detection_group: int = 4  # "odd-random": one of so many consecutive odd lines is left out
    spectrum: str | TableSpectrum | RecordSpectrum = "flat"
    quarter_car: QuarterCar = field(default_factory=QuarterCar)
    road: Road = field(default_factory=Road)

    def __post_init__(self) -> None:
        _check_band(self.f_min_hz, self.f_max_hz)
        check_above("max_displacement", self.max_displacement_m, 0.0, "m")
        check_above("max_velocity", self.max_velocity_m_s, 0.0, "m/s")
        if self.max_acceleration_m_s2 is not None:
            check_above("max_acceleration", self.max_acceleration_m_s2, 0.0, "m/s²")
        check_at_least("detection_group", self.detection_group, 2)
        if isinstance(self.spectrum, str):
            check_one_of("spectrum", self.spectrum, ("flat", "quarter-car", "road"))


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentSpec:
    """Band, lines, spectrum and limits of the control current."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    f_min_hz: float
    f_max_hz: float
    min_a: float
    max_a: float
    lines: LineChoice = "all"
    detection_group: int = 4
    spectrum: str | TableSpectrum = "control"
    corner_hz: float = 10.0  # of the "control" spectrum

    def __post_init__(self) -> None:
        _check_band(self.f_min_hz, self.f_max_hz)
        if self.max_a <= self.min_a:
            raise DesignError(f"max is {self.max_a:g} A: it must be above min ({self.min_a:g} A)")
        check_at_least("detection_group", self.detection_group, 2)
        check_above("corner", self.corner_hz, 0.0, "Hz")
        if isinstance(self.spectrum, str):
            check_one_of("spectrum", self.spectrum, ("flat", "control"))


@dataclass(frozen=True, slots=True, kw_only=True)
class HomogeniseSpec:
    """How phases are chosen so that the samples cover the working range."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    method: Literal["direct", "duym"] = "direct"
    # empty: velocity and current, or displacement and velocity without a current
    variables: tuple[Variable, ...] = ()
    grid: tuple[int, ...] = (10, 10)  # cells over the variables, in their order
    # direct: the part of the asked range that limits and rig allow, all of it, or whatever range the motion reaches
    range: Literal["achievable", "asked", "reached"] = "achievable"
    iterations: int | None = None  # at most so many; the method's own default where none is given

    def __post_init__(self) -> None:
        if len(set(self.variables)) != len(self.variables):
            raise DesignError(f"variables is {list(self.variables)}: each may be given once")
        if {"displacement", "acceleration"} <= set(self.variables):
            raise DesignError(
                f"variables is {list(self.variables)}: displacement and acceleration cannot be covered together "
                "(far out a motion turns): leave one out"
            )
        if self.variables and len(self.variables) < 2:
            raise DesignError(f"variables is {list(self.variables)}: give two or three")
        if self.variables and len(self.grid) != len(self.variables):
            raise DesignError(
                f"grid is {list(self.grid)}: it needs {len(self.variables)} numbers of cells, one for each "
                "of "
                f"{', '.join(self.variables)}"
            )
        for cells in self.grid:
            check_within("grid", cells, 2, 1000)
        total = 1
        for cells in self.grid:
            total *= cells
        if len(self.grid) not in (2, 3) or total > _MOST_CELLS:
            raise DesignError(
                f"grid is {list(self.grid)}: give two or three numbers, at most {_MOST_CELLS} cells in all"
            )
        if self.iterations is not None:
            check_within("iterations", self.iterations, 1, 100_000)


@dataclass(frozen=True, slots=True, kw_only=True)
class MultisineSpec:
    """A multisine: what is asked for. Random phases unless ``phases`` or a homogenised design says
    otherwise.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sample_rate_hz: float
    period_samples: int
    displacement: DisplacementSpec
    current: CurrentSpec | None = None
    periods: int = 1
    seed: int = 0
    realisation: int = 0  # other phases of the same design, on the same lines
    opposite_current: bool = False  # the current of the same design with its sign turned about its mean
    level: float = 1.0  # of the full displacement, which reaches the first limit
    phases: Literal["random", "schroeder", "crest"] = "random"
    # what is kept low; phases "crest"
    crest_of: Literal["limits", "displacement", "velocity", "acceleration"] = "limits"
    homogenise: HomogeniseSpec | None = None
    response: RigResponse | None = None  # of the rig: what is covered is measured behind it
    force: ForceEstimate | None = None  # one more limit of the motion

    def __post_init__(self) -> None:
        check_above("sample_rate", self.sample_rate_hz, 0.0, "Hz")
        check_within("period_samples", self.period_samples, 8, _MOST_SAMPLES)
        check_within("periods", self.periods, 1, max(1, _MOST_SAMPLES // self.period_samples))
        check_within("seed", self.seed, 0, 2**63 - 1)
        check_within("realisation", self.realisation, 0, 2**63 - 1)
        if not 0.0 < self.level <= 1.0:
            raise DesignError(f"level is {self.level:g}: it must lie above 0 and not above 1")
        for name, band in (("displacement", self.displacement), ("current", self.current)):
            if band is not None and band.f_max_hz >= self.sample_rate_hz / 2:
                raise DesignError(
                    f"{name}.f_max is {band.f_max_hz:g} Hz: it must lie below half the sample rate "
                    f"({self.sample_rate_hz / 2:g} Hz)"
                )
        if self.opposite_current and self.current is None:
            raise DesignError("opposite_current is true, but there is no [current]: add it or leave it out")
        self._check_variables()

    def _check_variables(self) -> None:
        if self.homogenise is None:
            return
        variables = self.covered_variables
        if self.current is None and "current" in variables:
            raise DesignError("homogenise.variables names current, but there is no [current]: add it or leave it out")
        if len(self.homogenise.grid) != len(variables):
            raise DesignError(
                f"homogenise.grid is {list(self.homogenise.grid)}: it needs {len(variables)} numbers of "
                "cells, for "
                f"{', '.join(variables)}"
            )

    @property
    def covered_variables(self) -> tuple[Variable, ...]:
        """The axes of the working range: as asked for, or velocity × current, or displacement × velocity."""
        if self.homogenise is not None and self.homogenise.variables:
            return self.homogenise.variables
        return ("displacement", "velocity") if self.current is None else ("velocity", "current")

    @property
    def grid(self) -> tuple[int, ...]:
        return (10, 10) if self.homogenise is None else self.homogenise.grid
