"""What there is to know of an element: one row of the catalogue."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Final, Literal

from identification.physical.elements.codes import CODE_OF, Code

if TYPE_CHECKING:
    from identification.scales import Scales

Values = Mapping[str, float]
Starts = Callable[["Scales"], Sequence[Values]]

Path = Literal["mount", "control", "core", "sensor"]
PATHS: Final[tuple[Path, ...]] = ("mount", "control", "core", "sensor")

TINY: Final = 1e-12  # "> 0" in floating point: knees, lengths and slopes that divide
UNBOUNDED: Final = -math.inf


class Family(IntEnum):
    """Which compiled function knows the equation: elements of one family have the same inputs and outputs."""

    DAMPING = 0  # a force over velocity, position and current
    FRICTION = 1  # a force over the direction of sliding and a memory
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


@dataclass(frozen=True, slots=True)
class ParameterSpec:
    """One parameter: name, SI unit, physical bounds, and whether data may ever move it."""

    name: str
    unit: str
    low: float = 0.0
    high: float = math.inf
    constant: float | None = None  # a convention such as T_ref: fixed, with this default
    default: float | None = None  # the value where a file leaves the parameter out
    refinement: bool = False  # finer than the canonical form: never free unless asked for, not written while neutral
    gain: bool = False  # acts through the current: zero, or out of a fit's reach, where there is none
    outside: bool = False  # a constant force that is no part of the dissipative sum
    of_run: bool = False  # belongs to a run: estimated for each record, never fitted


@dataclass(frozen=True, slots=True, kw_only=True)
class ElementSpec:
    """One row of the catalogue."""

    name: str
    family: Family
    title: str
    equation: str  # in the symbols of the model file: z, w of the core, e of a mount, u of the control
    parameters: tuple[ParameterSpec, ...]
    starts: Starts | None = None  # first values from the scales of the data; a model of the literature brings its own
    nameable: bool = True  # whether the naming workflow may add it by itself; models of the literature are chosen
    needs_current: bool = False
    memory: bool = False  # depends on the past, not on the present motion and current alone
    by_position: bool = False  # of the damping family: the force depends on z too
    linear_in_velocity: bool = False
    explicit_rate: bool = False  # a memory whose rate dh/dt an explicit method may integrate
    needs_amplitude: bool = False  # uses v_m = sqrt(v² − a·x)
    smooth_over: str | None = None  # the parameter without which the force jumps where w changes its sign

    @property
    def code(self) -> Code:
        """The number of the element in the compiled kernels."""
        return CODE_OF[self.name]

    @property
    def path(self) -> Path:
        """Where the element stands in the model."""
        return _PATH_OF[self.family]

    @property
    def modifier(self) -> bool:
        """Whether the element multiplies the dissipative sum."""
        return self.family == Family.MODIFIER

    @property
    def dissipative(self) -> bool:
        """Whether the element's force belongs to the dissipative sum."""
        return self.family in _DISSIPATIVE

    def index(self, parameter: str) -> int:
        """Position of a parameter in the element's block of the parameter vector."""
        return [p.name for p in self.parameters].index(parameter)
