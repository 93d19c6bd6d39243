"""What an exploration is asked to do, and its samples of the parameters."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from excitation.configuration import STRICT
from identification.errors import DataError, ModelError
from identification.physical.model import Model

Floats = NDArray[np.float64]

_MOST_SAMPLES = 1_000_000
_MOST_POINTS = 100_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """How far a sample may be from each measured test, as a share of the measured value.

    Half a limit keeps far fewer samples (about a half to the power of the parameters), double far more: the report
    tells for each limit how many samples it alone rejects.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    dynamic_stiffness: float = 0.5  # the three defaults: the limits of a study of a yaw damper (2024), its Table 2
    loss_angle: float = 0.3
    loop_shape: float = 0.3

    def __post_init__(self) -> None:
        for name in ("dynamic_stiffness", "loss_angle", "loop_shape"):
            if not 0.0 < getattr(self, name) < np.inf:
                raise DataError(f"limits.{name} is {getattr(self, name):g}: it must be a share above 0, such as 0.3")

    def row(self) -> Floats:
        """The limits in the order of `CRITERIA`, (3,)."""
        return np.array([self.dynamic_stiffness, self.loss_angle, self.loop_shape])


@dataclass(frozen=True, slots=True, kw_only=True)
class Exploration:
    """Samples of the parameters named by `vary`, each within `low` … `high` times its start, and the limits.

    Where `vary` is empty, the free parameters of the model vary. `points` are simulated for each cycle of a test.
    """

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    samples: int = 800
    low: float = 0.05
    high: float = 20.0
    sampling: Literal["log-uniform", "sobol"] = "log-uniform"
    seed: int = 1
    vary: tuple[str, ...] = ()
    points: int = 2000
    limits: Limits = field(default_factory=Limits)

    def __post_init__(self) -> None:
        if not 1 <= self.samples <= _MOST_SAMPLES:
            raise DataError(f"samples is {self.samples}: it must lie within 1 … {_MOST_SAMPLES}")
        if not 0.0 < self.low < self.high < np.inf:
            raise DataError(f"low … high is {self.low:g} … {self.high:g}: two factors above 0, the lower first")
        if self.seed < 0:
            raise DataError(f"seed is {self.seed}: it must not be negative")
        if not 100 <= self.points <= _MOST_POINTS:
            raise DataError(f"points is {self.points}: a cycle needs 100 … {_MOST_POINTS}")


def varied(model: Model, asked: Exploration) -> tuple[int, ...]:
    """Places in the parameter vector of what varies.

    Raises
    ------
    ModelError
        Where nothing varies, a name is not one of the model's, a start is not above zero, or a range leaves the
        parameter's bounds.
    """
    names = model.names()
    chosen = asked.vary or tuple(
        n for n, free, v in zip(names, model.free(), model.values(), strict=True) if free and v
    )
    if not chosen:
        raise ModelError(f"'{model.name}' has no free parameter: name what shall vary, as {names[0]}")
    if len(set(chosen)) < len(chosen):
        raise ModelError(f"vary names {max(chosen, key=chosen.count)} twice: once is enough")
    low, high = model.bounds()
    for name in chosen:
        if name not in names:
            raise ModelError(f"vary: '{model.name}' has no parameter '{name}': it has {', '.join(names)}")
        k = names.index(name)
        start = float(model.values()[k])
        if start <= 0.0:
            raise ModelError(f"{name} starts at {start:g}: factors on a start need one above 0")
        if not low[k] <= asked.low * start < asked.high * start <= high[k]:
            raise ModelError(
                f"{name}: {asked.low:g} … {asked.high:g} times {start:g} leaves its bounds [{low[k]:g}, {high[k]:g}]"
            )
    return tuple(names.index(name) for name in chosen)


def sampled(model: Model, asked: Exploration) -> Floats:
    """Parameter vectors, (samples, P), SI: the start with its varied entries times log-uniform factors.

    "sobol": the first points of a scrambled Sobol sequence (Owen 1998), which fill the box more evenly.
    """
    places = list(varied(model, asked))
    random = np.random.default_rng(asked.seed)
    if asked.sampling == "sobol":
        power = int(np.ceil(np.log2(max(asked.samples, 2))))
        from scipy.stats import qmc  # 0.3 s to import: only where it is needed

        unit = qmc.Sobol(len(places), scramble=True, rng=random).random_base2(power)[: asked.samples]
    else:
        unit = random.random((asked.samples, len(places)))
    values = np.tile(model.values(), (asked.samples, 1))
    values[:, places] *= np.exp(np.log(asked.low) + unit * (np.log(asked.high) - np.log(asked.low)))
    return values
