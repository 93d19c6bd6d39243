"""What the page of a report draws beside report.json: curves, maps, traces, tables and words, ready to be drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identification.errors import ReportFileError
from identification.report.sheet_data import SheetData

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]  # what is only looked at
Whole = NDArray[np.int64]
Flags = NDArray[np.bool_]

STEPS = 3  # of the gap: as given, parameters refitted, with the named effects


@dataclass(frozen=True, slots=True, kw_only=True)
class Words:
    """Title and equation of every element of the catalogue."""

    elements: tuple[str, ...]
    titles: tuple[str, ...]
    equations: tuple[str, ...]

    def __post_init__(self) -> None:
        _columns(elements=self.elements, titles=self.titles, equations=self.equations)

    def title(self, element: str) -> str:
        """The title of an element; its name where there is none."""
        return self.titles[self.elements.index(element)] if element in self.elements else element

    def equation(self, element: str) -> str:
        """The equation of an element; nothing where there is none."""
        return self.equations[self.elements.index(element)] if element in self.elements else ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Interval:
    """Ends of the 95 % interval of a gap at each step, (3,) each, N."""

    low: Floats
    high: Floats

    def __post_init__(self) -> None:
        _series(low=self.low, high=self.high)
        if self.low.size != STEPS:
            raise ReportFileError(f"low has {self.low.size} values: one for each of the {STEPS} steps is due")


@dataclass(frozen=True, slots=True, kw_only=True)
class GapMap:
    """Mean of measured minus simulated force, (X, V), N, over displacement (X,), m, and velocity (V,), m/s.

    NaN where there are too few samples.
    """

    displacement: Floats
    velocity: Floats
    mean: Singles

    def __post_init__(self) -> None:
        _series(displacement=self.displacement)
        _series(velocity=self.velocity)
        due = (self.displacement.size, self.velocity.size)
        if self.mean.shape != due:
            raise ReportFileError(f"mean has shape {self.mean.shape}: {due} is due")


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Mean and rms of the residual over one variable: arrays (B,), N.

    `band` is how far the means of single runs scatter around it: a curve within its band is not one of the machine.
    """

    variable: str
    unit: str
    centre: Floats
    mean: Floats
    rms: Floats
    band: Floats

    def __post_init__(self) -> None:
        _series(centre=self.centre, mean=self.mean, rms=self.rms, band=self.band)


@dataclass(frozen=True, slots=True, kw_only=True)
class Loop:
    """Forces over the motion of one run, (M,) each: every `step`-th of the last `shown` of its `samples`."""

    run: str
    held_out: bool
    samples: int
    shown: int
    step: int
    displacement: Singles  # m
    velocity: Singles  # m/s
    measured: Singles  # N
    refitted: Singles
    final: Singles

    def __post_init__(self) -> None:
        _series(
            displacement=self.displacement,
            velocity=self.velocity,
            measured=self.measured,
            refitted=self.refitted,
            final=self.final,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Spectrum:
    """Amplitude density of what is left in one run, (F,) each, N/√Hz, in bands about a frequency (F,), Hz."""

    run: str
    frequency: Floats
    refitted: Floats
    final: Floats
    noise_floor: float

    def __post_init__(self) -> None:
        _series(frequency=self.frequency, refitted=self.refitted, final=self.final)
        if self.frequency.size == 0:
            raise ReportFileError("frequency is empty: at least one band is due")


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """Mean forces over one variable, (B,) each, N: all beyond the best fit without the name."""

    name: str
    rival: str | None
    variable: str
    unit: str
    centre: Floats
    missing: Floats  # measured less simulated
    own: Floats
    other: Floats | None  # what the rival adds

    def __post_init__(self) -> None:
        _series(centre=self.centre, missing=self.missing, own=self.own)
        if self.other is not None:
            _series(centre=self.centre, other=self.other)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rivals:
    """What each candidate in one place would leave of the gap's energy, (K,), %, the most first."""

    place: str  # element that was named there; empty where none was
    beside: str
    elements: tuple[str, ...]
    left: Floats

    def __post_init__(self) -> None:
        _columns(elements=self.elements, left=self.left)


@dataclass(frozen=True, slots=True, kw_only=True)
class Strengths:
    """Strength of each named effect in every training run, (E, R), relative to the common fit; NaN: it can't tell."""

    elements: tuple[str, ...]
    values: Floats

    def __post_init__(self) -> None:
        if self.values.ndim != 2 or len(self.values) != len(self.elements):
            raise ReportFileError(f"values has shape {self.values.shape}: {len(self.elements)} rows are due")


@dataclass(frozen=True, slots=True, kw_only=True)
class AsGood:
    """Elements that fit as well as the one named, but are less simple."""

    element: str
    others: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class RuledOut:
    """Candidates that were tried and not named, (K,) each, where each came closest."""

    elements: tuple[str, ...]
    beside: tuple[str, ...]
    left: Floats  # share of the gap's energy after a full fit
    promised: Floats  # share that its signature promised to close
    parameters: Whole

    def __post_init__(self) -> None:
        _columns(elements=self.elements, beside=self.beside, left=self.left, promised=self.promised,
                 parameters=self.parameters)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class BaseTable:
    """Parameters of the model as given and as fitted, (P,) each; `std` is NaN where there is none."""

    titles: tuple[str, ...]  # of the elements
    parameters: tuple[str, ...]
    units: tuple[str, ...]
    given: Floats
    now: Floats
    std: Floats
    held: Flags

    def __post_init__(self) -> None:
        _columns(titles=self.titles, parameters=self.parameters, units=self.units, given=self.given, now=self.now,
                 std=self.std, held=self.held)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class PageData:
    """Everything that the page draws and report.json does not hold."""

    report: str  # fingerprint of the report.json that it belongs to
    name: str  # of the model as given
    reproduce: str  # command that explains again
    words: Words
    aliases: tuple[str, ...]  # notes that no motion of the actuator can settle
    train: Interval
    held_out: Interval
    gap_map: GapMap | None
    profiles: tuple[Profile, ...]
    loops: tuple[Loop, ...]
    spectrum: Spectrum
    shapes: tuple[Shape, ...]
    rivals: tuple[Rivals, ...]
    strengths: Strengths | None
    as_good: tuple[AsGood, ...]
    ruled_out: RuledOut
    base: BaseTable
    sheet: SheetData | None = None  # where the runs allow one


def _series(**arrays: NDArray[np.generic]) -> None:
    """Raise unless all are rows of one length."""
    for name, values in arrays.items():
        if values.ndim != 1:
            raise ReportFileError(f"{name} has shape {values.shape}: one row is due")
    _columns(**arrays)


def _columns(**columns: tuple[str, ...] | NDArray[np.generic]) -> None:
    """Raise unless all have one length."""
    (first, column), *others = columns.items()
    for name, values in others:
        if len(values) != len(column):
            raise ReportFileError(f"{name} has {len(values)} values and {first} {len(column)}: as many are due")
