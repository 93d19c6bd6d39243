"""What there is to know of an element: one row of the catalogue."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, IntEnum
from typing import TYPE_CHECKING, Final, Literal

if TYPE_CHECKING:
    from identification.scales import Scales

Values = Mapping[str, float]
Starts = Callable[["Scales"], Sequence[Values]]
Limits = Callable[["Scales"], tuple[float, float]]
Begins = Callable[[Values, "Scales"], float | None]

Path = Literal["mount", "control", "core", "sensor"]
PATHS: Final[tuple[Path, ...]] = ("mount", "control", "core", "sensor")

Place = Literal["k", "c", "gap", "k2", "c2", "c_control", "air", "f_half", "side", "k_slip", "f_slip", "soft", "f_soft"]

TINY: Final = 1e-12  # "> 0" in floating point: knees, lengths and slopes that divide
UNBOUNDED: Final = -math.inf


class Family(IntEnum):
    """Which compiled function knows the equation: elements of one family have the same inputs and outputs."""

    DAMPING = 0  # a force over velocity, position and current
    FRICTION = 1  # a force over the direction of sliding or a memory
    SPRING = 2  # a force over position, outside the dissipative sum
    MOTION = 3  # a force that also follows from the rig's acceleration or amplitude; few models hold one
    MODIFIER = 4  # a factor on the dissipative sum
    MOUNT = 5
    CONTROL = 6
    SENSOR = 7


_PATH_OF: Final[Mapping[Family, Path]] = {
    Family.DAMPING: "core",
    Family.FRICTION: "core",
    Family.SPRING: "core",
    Family.MOTION: "core",
    Family.MODIFIER: "core",
    Family.MOUNT: "mount",
    Family.CONTROL: "control",
    Family.SENSOR: "sensor",
}
_DISSIPATIVE: Final = (Family.DAMPING, Family.FRICTION, Family.MOTION)


class Remedy(Enum):
    """What a further test has to change so that a parameter shows, in words; of two, the earlier is tried first."""

    CURRENT = "another current"
    FREQUENCY = "another frequency at the same speed"
    STROKE = "a larger stroke"
    SPEEDS = "lower and higher speeds"
    ANY = "another amplitude and frequency"


class Curve(IntEnum):
    """What a force over velocity is to a model that has it, or might."""

    LAW = 1  # a law of one strength: the whole damping of a model may be one
    WHOLE = 2  # the same with a shape of its own: beside another it counts as one more parameter
    BEND = 3  # only bends the curve of another element


@dataclass(frozen=True, slots=True)
class Alias:
    """Another cause of the same force, and the test beside the rig's programme that splits the two."""

    cause: str
    test: str


UNBOLTED: Final = "read the load cell with the damper unbolted"
WITHOUT_DAMPER: Final = "play the same motion without the damper: what is measured then is the rig's"


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """What an element of a fitted model stands in, as far as its name depends on it."""

    others: Sequence[ElementSpec]  # the rows of all other elements
    force: float  # the measured one, N rms
    stroke: float  # the longest, m
    swing: float  # the largest of the current within one run, A
    speed: float  # rms, m/s
    slow: float  # the lowest typical speed, m/s
    current: float  # mean, A


@dataclass(frozen=True, slots=True, kw_only=True)
class Departure:
    """The element is no effect of its own where it is only how a real `of` departs from the ideal one."""

    of: Mapping[str, float]  # each other element, and the share of what that adds: one that closes less is a departure
    is_only: Callable[[Values, Values], bool]  # whether own values and those of the other say so
    words: Callable[[Values], str]  # what a reader is told of it then


@dataclass(frozen=True, slots=True, kw_only=True)
class Growth:
    """Where else a fit of an element may start: out of the values of another one that has been fitted."""

    of: str  # the other element
    starts: Callable[[Values, Scales], Sequence[Values]]  # from its values; what is finer in it stays as it is


@dataclass(frozen=True, slots=True)
class ParameterSpec:
    """One parameter: name, SI unit, physical bounds, and what a fit and the search may do with it."""

    name: str
    unit: str
    low: float = 0.0
    high: float = math.inf
    constant: float | None = None  # a convention such as T_ref: fixed, with this default
    default: float | None = None  # the value where a file leaves the parameter out
    refinement: bool = False  # finer than the canonical form: never free unless asked for, not written while neutral
    late: bool = False  # of a refinement: free only once the element is named; before, it would hide another one
    shape: str = ""  # of a refinement: those of one shape are free together, those of another one are tried apart
    signed: bool = False  # a strength that may be of either sign: a first value takes that of the gap
    begins: Begins | None = None  # first value of a refinement, out of the element's own; none where it can't be seen
    gain: bool = False  # acts through the current: zero, or out of a fit's reach, where there is none
    of_curves: bool = False  # a share of the size of all other damping curves together
    preload: bool = False  # a constant force is part of what it makes: no motion tells the two apart
    outside: bool = False  # a constant force that is no part of the dissipative sum
    remembers: bool = False  # the element carries a state where this is not zero
    warms: bool = False  # its force follows the temperature where this is not zero
    place: Place | None = None  # of a mount's parameter: which part of spring, damper, gap and branch it is
    of_run: bool = False  # belongs to a run: estimated for each record, never fitted
    held: bool = False  # acts only as a product with another: fixed in what the search and the literature make
    bound_is_meant: bool = False  # a fit may end on its bound: that is a case of the element, not the loss of it
    high_is_meant: bool = False  # the same of the upper bound and limit alone
    limits: Limits | None = None  # of the search: a shape outside of what the data span can't be seen in them
    remedy: Remedy = Remedy.ANY  # what lets it be seen
    switch: str = ""  # of what is 0 or 1: what 1 means; a fit is made with either, and never moves it
    beside: bool = False  # of a switch: at 1 the element acts beside the mount, which a model without one does not tell


def of_shape(
    shape: str,
    name: str,
    unit: str,
    begins: Begins,
    *,
    low: float = 0.0,
    neutral: float = 0.0,
    place: Place | None = None,
    remedy: Remedy = Remedy.STROKE,
) -> ParameterSpec:
    """A parameter of a finer shape that is sought once its element is named."""
    return ParameterSpec(
        name, unit, low, default=neutral, refinement=True, late=True, shape=shape, begins=begins, place=place,
        remedy=remedy,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementSpec:
    """One row of the catalogue."""

    name: str
    family: Family
    title: str
    equation: str  # in the symbols of the model file: z, w of the core, e of a mount, u of the control
    parameters: tuple[ParameterSpec, ...]
    starts: Starts | None = None  # first values from the scales of the data; without, the search does not try it
    nameable: bool = True  # whether the naming workflow may add it by itself; models of the literature are chosen
    needs_current: bool = False
    needs_temperature: bool = False  # seen only where it varies
    memory: bool = False  # depends on the past, not on the present motion and current alone
    by_position: bool = False  # of the damping family: the force depends on z too
    linear_in_velocity: bool = False
    explicit_rate: bool = False  # a memory whose rate dh/dt an explicit method may integrate
    needs_amplitude: bool = False  # uses v_m = sqrt(v² − a·x)
    smooth_over: str | None = None  # the parameter without which the force jumps where w changes its sign
    curve: Curve | None = None  # over velocity, where it is one
    dry_friction: bool = False  # two in one machine are one, of another form
    falls_with_speed: bool = False  # of dry frictions: one that does differs from the others by that alone
    once: bool = False  # two in a model act as one
    finer_of: tuple[str, ...] = ()  # elements beside which it would only be a finer shape of theirs: no name there
    alone: bool = False  # the only element of its path
    moves_all: bool = False  # acts on the force of everything before it, rather than adding to it
    tone: bool = False  # found by its line in the spectrum, by a search of its own
    remanent: bool = False  # what the current was before the run still acts
    alias: Alias | None = None  # what looks the same under any motion
    departure: Departure | None = None  # when it is no effect of its own
    growth: Growth | None = None  # out of a simpler element, where a fit has lost what the name says
    does_both: tuple[str, ...] = ()  # elements whose work it does alone: tried in their place where all are named
    limits_of: tuple[Growth, ...] = ()  # richer elements of which it is a limit: tried wherever one of these fits
    # Whether the values take more than one cause: of two elements that fit alike the other one is named.
    unlikely: Callable[[Values, Surroundings], bool] | None = None
    # Whether the values, beside elements of these rows, deny the name: such a fit has lost its element.
    denied: Callable[[Values, Sequence[ElementSpec]], bool] | None = None
    # Whether the values, in these surroundings, are what another element is: such a fit gets no name.
    mistaken: Callable[[Values, Surroundings], bool] | None = None

    @property
    def path(self) -> Path:
        """Where the element stands in the model."""
        return _PATH_OF[self.family]

    @property
    def friction(self) -> bool:
        """Whether the force follows what slides, at once or over a travel: two in one machine are one."""
        return self.dry_friction or self.family == Family.FRICTION

    @property
    def modifier(self) -> bool:
        """Whether the element multiplies the dissipative sum."""
        return self.family == Family.MODIFIER

    @property
    def dissipative(self) -> bool:
        """Whether the element's force belongs to the dissipative sum."""
        return self.family in _DISSIPATIVE

    @property
    def adds(self) -> bool:
        """Whether the element adds a force to what is there without it: only such stand on a foreign simulation."""
        return self.path in ("core", "sensor") and not (self.modifier or self.moves_all)

    @property
    def carries(self) -> bool:
        """Whether the element's curve may be the whole damping of a model."""
        return self.curve in (Curve.LAW, Curve.WHOLE)

    @property
    def shaped(self) -> bool:
        """Whether the force is a bent curve over velocity: two of them may be taken for one another."""
        return self.curve is not None and not (self.linear_in_velocity or self.memory)

    @property
    def bent(self) -> bool:
        """The same over velocity alone, at any current."""
        return self.shaped and not self.needs_current

    @property
    def after_reversal(self) -> bool:
        """Whether it shows just after the motion turns, as a friction, a soft joint and a lag do: two of them may be
        taken for one another."""
        lags = self.moves_all or (self.memory and self.path == "core")
        return self.friction or self.path == "mount" or lags

    @property
    def constant_force(self) -> bool:
        """Whether the element is a constant force and nothing else: beside another free one it can't be seen."""
        return all(p.outside for p in self.parameters)

    @property
    def held(self) -> tuple[str, ...]:
        """Parameters that act only as a product with another."""
        return tuple(p.name for p in self.parameters if p.held)

    def index(self, parameter: str) -> int:
        """Position of a parameter in the element's block of the parameter vector."""
        return [p.name for p in self.parameters].index(parameter)
