"""Multisines for rigs of several axes: realisations in which the inputs are orthogonal at every line."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from excitation.checks import check_above, check_within
from excitation.configuration import STRICT
from excitation.errors import DesignError
from excitation.multisine import displacement_tones
from excitation.multisine_spec import DisplacementSpec, MultisineSpec
from excitation.periodic import Multitone
from excitation.quantities import motion_quantities

__all__ = ["AxisSpec", "MultiAxis", "MultiAxisSpec", "mixing_turns", "multi_axis"]

_MOST_AXES = 6  # a rigid body has no more
_MOST_SAMPLES = 2**24  # of all axes and realisations: 134 MB
# share of a limit that is used, so that rounding does not exceed it
_SHARE_OF_LIMIT = 1.0 - 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisSpec:
    """One axis: its name, and band, lines, spectrum and limits of its displacement (m) or angle (rad)."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    name: str
    displacement: DisplacementSpec
    unit: Literal["m", "rad"] = "m"

    def __post_init__(self) -> None:
        if not self.name.isidentifier():
            raise DesignError(f"name is {self.name!r}: an axis is named by letters, digits and _")


@dataclass(frozen=True, slots=True, kw_only=True)
class MultiAxisSpec:
    """Up to six axes with a common period; as many realisations as the matrix needs."""

    __pydantic_config__: ClassVar[dict[str, Any]] = STRICT

    sample_rate_hz: float
    period_samples: int
    axes: tuple[AxisSpec, ...]
    matrix: Literal["hadamard", "dft"] = "hadamard"
    periods: int = 1
    seed: int = 0

    def __post_init__(self) -> None:
        check_above("sample_rate", self.sample_rate_hz, 0.0, "Hz")
        if not 1 <= len(self.axes) <= _MOST_AXES:
            raise DesignError(f"axes has {len(self.axes)} entries: give one to {_MOST_AXES}")
        names = [axis.name for axis in self.axes]
        if len(set(names)) < len(names):
            raise DesignError(f"axes are named {', '.join(names)}: each name may be given once")
        commands = len(self.axes) * self.realisations
        check_within("period_samples", self.period_samples, 8, _MOST_SAMPLES // commands)
        check_within("periods", self.periods, 1, _MOST_SAMPLES // (commands * self.period_samples))
        check_within("seed", self.seed, 0, 2**63 - 1)
        for axis in self.axes:
            self.single(axis)  # refuses a band beyond half the sample rate

    @property
    def realisations(self) -> int:
        return int(mixing_turns(self.matrix, len(self.axes)).shape[0])

    def single(self, axis: AxisSpec) -> MultisineSpec:
        """The axis as a multisine of its own, with phases of its own."""
        return MultisineSpec(
            sample_rate_hz=self.sample_rate_hz,
            period_samples=self.period_samples,
            displacement=axis.displacement,
            seed=self.seed,
            realisation=self.axes.index(axis),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MultiAxis:
    """One period of each axis in each realisation; ``periods`` of it are played."""

    spec: MultiAxisSpec
    commands: NDArray[np.float64]  # (realisations, axes, N), in the unit of the axis

    def input_matrix(self, line: int) -> NDArray[np.complex128]:
        """Amplitudes of a DFT line, (axes, realisations): its columns are the inputs of the realisations."""
        turn = np.exp(-2j * np.pi * line * np.arange(self.commands.shape[2]) / self.commands.shape[2])
        return np.asarray(2.0 / self.commands.shape[2] * (self.commands @ turn).T)


def mixing_turns(matrix: Literal["hadamard", "dft"], axes: int) -> NDArray[np.float64]:
    """Phases in turns that are added to each axis in each realisation, (realisations, axes): e^(2πj·turns) has
    orthogonal columns of unit entries. "dft": as many realisations as axes; "hadamard": 1, 2, 4 or 8, signs only, so
    that an axis has the same peaks in all of them.

    References
    ----------
    Dobrowiecki, Schoukens & Guillaume, IEEE Trans. Instrum. Meas. 55 (2006).
    """
    if matrix == "dft":
        number = np.arange(axes)
        return np.asarray((number[:, None] * number[None, :] % axes) / axes)
    order = 1
    while order < axes:
        order *= 2
    # Sylvester's matrix: the sign of entry (r, c) is the parity of the bits that r and c share
    return np.array([[0.5 * ((r & c).bit_count() % 2) for c in range(axes)] for r in range(order)])


def multi_axis(spec: MultiAxisSpec) -> MultiAxis:
    """Random-phase multisines of all axes. At each line the realisations' inputs are those of the first one, turned by
    ``mixing_turns``: the matrix of the inputs is unitary up to the amplitudes of the axes, so that it can be inverted
    wherever every axis is excited. Each axis is scaled as a whole until one of its limits is reached in a realisation.

    Raises DesignError where a band holds no line or a table does not span it.
    """
    turns = mixing_turns(spec.matrix, len(spec.axes))
    commands = np.empty((turns.shape[0], len(spec.axes), spec.period_samples))
    for number, axis in enumerate(spec.axes):
        single = spec.single(axis)
        tones = displacement_tones(single)
        turned = [tones.with_phases(tones.phase_turns + turn) for turn in turns[:, number]]
        factor = min(_factor(single, one) for one in turned)
        for realisation, one in enumerate(turned):
            commands[realisation, number] = one.scaled(factor).samples()
    commands.flags.writeable = False
    return MultiAxis(spec=spec, commands=commands)


def _factor(single: MultisineSpec, tones: Multitone) -> float:
    """What scales the tones to their first limit."""
    bare = replace(single, response=None, force=None)
    peaks = [
        (q.limit, float(np.abs(q.tones(tones).samples()).max()))
        for q in motion_quantities(bare, tones)
        if q.limit is not None
    ]
    return min(limit / peak for limit, peak in peaks) * _SHARE_OF_LIMIT
