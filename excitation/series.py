"""One design at several levels and in several realisations, as a plan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from excitation.configuration import to_config, to_spec
from excitation.errors import DesignError
from excitation.kinds import Kind
from excitation.multisine import current_tones, displacement_tones, random_phase
from excitation.multisine_spec import CurrentSpec, MultisineSpec
from excitation.periodic import Multitone
from excitation.plan import Test, TestPlan
from excitation.service import with_record
from excitation.signal import JSON, Excitation
from excitation.synthesis import excitation_from_config

__all__ = ["one_or_series"]

_KEYS = frozenset({"levels", "realisations", "orthogonal", "kind"})  # they do not belong to the multisine


def one_or_series(kind: str, config: Mapping[str, JSON]) -> Excitation | TestPlan:
    """The multisine of a configuration, or a plan where it asks for levels or realisations. Raises DesignError."""
    own: dict[str, JSON] = {**{key: value for key, value in config.items() if key not in _KEYS}, "kind": kind}
    levels, realisations = config.get("levels", [own.get("level", 1.0)]), config.get("realisations", 1)
    if not isinstance(levels, (list, tuple)) or not levels:
        raise DesignError(f"levels is {levels!r}: give a list of shares of the full displacement, above 0, up to 1")
    if type(realisations) is not int or not 1 <= realisations <= 1000:
        raise DesignError(f"realisations is {realisations!r}: it must lie in 1 … 1000")
    orthogonal = config.get("orthogonal", False)
    if not isinstance(orthogonal, bool):
        raise DesignError(f"orthogonal is {orthogonal!r}: it must be true or false")
    if orthogonal and (realisations % 2 or "current" not in own):
        raise DesignError(
            f"orthogonal is true with {realisations} realisations "
            f"{'and' if 'current' in own else 'and without'} [current]: it needs two inputs, displacement and current, "
            "and an even number of realisations"
        )
    if "levels" not in config and realisations == 1:
        return excitation_from_config(own)
    return _series(own, list(levels), realisations, orthogonal=orthogonal)


def _series(config: Mapping[str, JSON], levels: list[JSON], realisations: int, *, orthogonal: bool) -> TestPlan:
    """Every realisation at every level, the levels rising.

    Orthogonal: of each two realisations the second has the displacement of the first and the opposite current, so that
    the matrix of both inputs over both realisations is orthogonal at every line.

    References
    ----------
    Dobrowiecki, Schoukens & Guillaume, IEEE Trans. Instrum. Meas. 55 (2006): orthogonal multisines, Hadamard matrices.
    """
    first = int(str(config.get("realisation", 0)))
    numbered = [{**config, **_numbered(first, n, orthogonal)} for n in range(realisations)]
    shares = [1.0] * realisations
    if config["kind"] == Kind.MULTISINE and realisations > 1:
        numbered, shares = _of_one_spectrum(numbered)
    tests = [
        Test(
            name=f"level_{number + 1}_realisation_{n + 1}",
            excitation=excitation_from_config({**one, "level": _times(level, share)}, f"levels[{number}]"),
        )
        for number, level in enumerate(levels)
        for n, (one, share) in enumerate(zip(numbered, shares, strict=True))
    ]
    return TestPlan(tests=tuple(tests), design=config)


def _numbered(first: int, number: int, orthogonal: bool) -> dict[str, JSON]:
    if not orthogonal:
        return {"realisation": first + number}
    return {"realisation": first + number // 2, "opposite_current": number % 2 == 1}


def _times(level: JSON, share: float) -> JSON:
    """A level that is no number is refused where it is read."""
    return level * share if isinstance(level, (int, float)) and not isinstance(level, bool) else level


def _of_one_spectrum(configs: list[dict[str, JSON]]) -> tuple[list[dict[str, JSON]], list[float]]:
    """Configurations with which every realisation has the same amplitudes and mean current, and their levels.

    The one with the highest peak reaches the limits, the others stay below them: a best linear approximation and its
    distortion belong to one spectrum (Pintelon & Schoukens, 2012, chapter 4). Each to its own peak, the rms values of
    eight realisations of 37 lines differed by a factor of 1.55.
    """
    specs = [with_record(to_spec(MultisineSpec, _full(one)))[0] for one in configs]
    if specs[0].current is not None:
        ranges = _of_one_current(specs)
        configs = [{**one, "current": to_config(own)} for one, own in zip(configs, ranges, strict=True)]
        specs = [replace(spec, current=own) for spec, own in zip(specs, ranges, strict=True)]
    scales = [_scale(random_phase(spec).displacement, displacement_tones(spec)) for spec in specs]
    return configs, [min(scales) / scale for scale in scales]


def _full(config: Mapping[str, JSON]) -> dict[str, JSON]:
    return {**{key: value for key, value in config.items() if key != "kind"}, "level": 1.0}


def _of_one_current(specs: Sequence[MultisineSpec]) -> list[CurrentSpec]:
    """The current of each with the range that gives all of them the same scale and mean."""
    shapes = [_shape(spec) for spec in specs]
    low, high = min(float(one.min()) for one in shapes), max(float(one.max()) for one in shapes)
    made = []
    for spec, shape in zip(specs, shapes, strict=True):
        asked = spec.current
        assert asked is not None  # the caller has looked
        scale = (asked.max_a - asked.min_a) / (high - low)
        ends = asked.min_a + scale * (float(shape.min()) - low), asked.max_a - scale * (high - float(shape.max()))
        made.append(replace(asked, min_a=ends[0], max_a=ends[1]))
    return made


def _shape(spec: MultisineSpec) -> NDArray[np.float64]:
    """A period of the current, (N,), at the amplitudes that it has before it is scaled."""
    found, tones = random_phase(spec).current, current_tones(spec)
    assert found is not None
    assert tones is not None
    return found.samples() * (1.0 / _scale(found, tones))


def _scale(scaled: Multitone, tones: Multitone) -> float:
    return float(scaled.amplitude.sum() / tones.amplitude.sum())
