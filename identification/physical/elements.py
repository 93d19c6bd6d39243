"""What there is to know of an element: its row in the catalogue, its parameters, and its number in the kernels."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, Final, Literal

if TYPE_CHECKING:
    from identification.scales import Scales

Values = Mapping[str, float]
Starts = Callable[["Scales"], Sequence[Values]]

Path = Literal["mount", "control", "core", "sensor"]
PATHS: Final[tuple[Path, ...]] = ("mount", "control", "core", "sensor")


class Code(IntEnum):
    """The number of an element in the compiled kernels."""

    VISCOUS = 0
    ARCTAN = 1
    PIECEWISE = 2
    VALVE = 3
    QUADRATIC = 4
    RELIEF = 5
    ASYMMETRY = 6
    TANH = 7
    BOUC_WEN = 8
    COULOMB = 9
    STRIBECK = 10
    PRESLIDING = 11
    STIFFNESS = 12
    CUBIC = 13
    GAS = 14
    STOP = 15
    POSITION = 16
    FADE = 17
    REVERSAL_LAG = 18
    COMPLIANCE = 30
    FREE_PLAY = 31
    RELAXING = 32
    DASHPOT = 33
    LAG = 40
    DELAY = 41
    SATURATION = 42
    HYSTERESIS = 43
    FORCE_DELAY = 50
    OFFSET = 51
    MASS = 52
    DRIFT = 53
    HUM = 54
    PARALLEL = 55
    MODULATED_TANH = 60
    BIVISCOUS = 61
    SIGMOID = 62
    LUGRE = 63


@dataclass(frozen=True, slots=True)
class ParameterSpec:
    """One parameter: name, SI unit, physical bounds, and whether data may ever move it."""

    name: str
    unit: str
    low: float = 0.0
    high: float = math.inf
    constant: float | None = None  # a convention such as T_ref: fixed, with this default
    default: float | None = None  # the value where a file leaves the parameter out
    refinement: bool = (
        False  # a finer shape than the canonical form: never free unless asked for, not written while neutral
    )


@dataclass(frozen=True, slots=True)
class ElementSpec:
    """One row of the catalogue."""

    name: str
    path: Path
    code: Code
    title: str
    equation: str  # in the symbols of the model file: z, w of the core, e of a mount, u of the control
    parameters: tuple[ParameterSpec, ...]
    needs_current: bool = False
    modifier: bool = False
    memory: bool = False
    starts: Starts | None = None  # first values from the scales of the data; a model of the literature brings its own
    nameable: bool = True  # whether the naming workflow may add it by itself; models of the literature are chosen

    def index(self, parameter: str) -> int:
        """Position of a parameter in the element's block of the parameter vector."""
        return [p.name for p in self.parameters].index(parameter)
