"""Makes the samples of an excitation from its configuration, in which `kind` names the generator."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import log10

import numpy as np
from numpy.typing import NDArray

from excitation import kinds
from excitation.checks import check_one_of
from excitation.configuration import to_config, to_spec
from excitation.errors import DesignError
from excitation.file_drive import FileSpec, file_drive
from excitation.harmonic import SineSpec, StepsSpec, TriangleSpec, sine, steps, triangle
from excitation.homogenise import homogenised
from excitation.kinds import DESIGNED, HOMOGENISED, Kind
from excitation.multisine import (
    as_excitation,
    covered,
    current_tones,
    displacement_tones,
    fitted,
    random_phase,
    repeated,
)
from excitation.multisine_spec import HomogeniseSpec, MultisineSpec
from excitation.noise import NoiseSpec, noise
from excitation.periodic import Multitone, Repeated
from excitation.replay import ReplaySpec, replay
from excitation.road_drive import RoadDriveSpec, road_drive
from excitation.service import service_figures, with_record
from excitation.signal import JSON, Excitation
from excitation.sweep import SweepSpec, sweep

__all__ = [
    "SPECS",
    "FoundPhases",
    "excitation_from_config",
    "excitation_of_phases",
    "extreme_of",
    "homogenised_multisine",
    "multisine",
    "phases_of",
    "reads_a_file",
]

SPECS: Mapping[str, type] = {  # what the keys of each kind are; one entry for each of DESIGNED
    Kind.MULTISINE.value: MultisineSpec,
    HOMOGENISED: MultisineSpec,
    Kind.SINE.value: SineSpec,
    Kind.TRIANGLE.value: TriangleSpec,
    Kind.STEPS.value: StepsSpec,
    Kind.SWEEP.value: SweepSpec,
    kinds.NOISE: NoiseSpec,
    Kind.ROAD.value: RoadDriveSpec,
    kinds.REPLAY: ReplaySpec,
    kinds.FILE: FileSpec,
}


def excitation_from_config(config: Mapping[str, JSON], where: str = "") -> Excitation:
    """The excitation that ``config`` describes: `kind` is one of DESIGNED, the other keys are those of the kind.

    Raises DesignError, one line that begins with ``where``.
    """
    if not isinstance(config, Mapping):
        raise DesignError(f"configuration is {config!r:.60}: it must be a table of keys and values").below(where)
    kind = config.get("kind")
    parameters = {key: value for key, value in config.items() if key != "kind"}
    try:
        check_one_of("kind", kind, DESIGNED)
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            return _make(str(kind), parameters)
    except ArithmeticError as error:
        raise DesignError(f"a value is too large or too small to compute with ({error}): {extreme_of(config)}").below(
            where
        ) from error
    except DesignError as error:
        raise error.below(where) from error


def extreme_of(config: Mapping[str, JSON]) -> str:
    """The number that is furthest from 1, with its key."""
    found = max(_numbers(config, ""), key=lambda pair: abs(log10(abs(pair[1]))), default=("", 1.0))
    return f"{found[0]} is {found[1]:g}"


def _numbers(value: JSON, place: str) -> Iterator[tuple[str, float]]:
    match value:
        case bool() | str() | None:
            return
        case int() | float():
            if value:
                yield place, float(value)
        case Mapping():
            for key, inner in value.items():
                yield from _numbers(inner, f"{place}.{key}".lstrip("."))
        case _:
            for inner in value:
                yield from _numbers(inner, place)


def reads_a_file(config: Mapping[str, JSON]) -> bool:
    """Whether making the excitation would read a file of this machine: what comes from elsewhere must not."""
    if config.get("kind") in (kinds.REPLAY, kinds.FILE):
        return True
    displacement = config.get("displacement")
    spectrum = displacement.get("spectrum") if isinstance(displacement, Mapping) else None
    return isinstance(spectrum, Mapping) and "record" in spectrum and not spectrum.get("frequency")


def _make(kind: str, config: Mapping[str, JSON]) -> Excitation:
    match kind:
        case Kind.SINE:
            return sine(to_spec(SineSpec, config))
        case Kind.TRIANGLE:
            return triangle(to_spec(TriangleSpec, config))
        case Kind.STEPS:
            return steps(to_spec(StepsSpec, config))
        case Kind.SWEEP:
            return sweep(to_spec(SweepSpec, config))
        case kinds.NOISE:
            return noise(to_spec(NoiseSpec, config))
        case Kind.ROAD:
            return road_drive(to_spec(RoadDriveSpec, config))
        case kinds.REPLAY:
            return replay(to_spec(ReplaySpec, config))
        case kinds.FILE:
            return file_drive(to_spec(FileSpec, config))
        case _:
            return _multisine(kind, to_spec(MultisineSpec, _completed(config)))


_WRITTEN_OUT = frozenset({"periods", "seed", "realisation", "level", "phases", "crest_of"})


def _completed(config: Mapping[str, JSON]) -> Mapping[str, JSON]:
    """A design that was written out, with all its defaults, before there was a choice of range keeps what was played:
    the range that the motion reaches."""
    how = config.get("homogenise")
    if isinstance(how, Mapping) and "range" not in how and config.keys() >= _WRITTEN_OUT:
        return {**config, "homogenise": {**how, "range": "reached"}}
    return config


def multisine(spec: MultisineSpec) -> Excitation:
    """Lines with random phases, or with phases of a low crest factor, within the limits of ``spec``."""
    return _multisine(str(Kind.MULTISINE), spec)


def homogenised_multisine(spec: MultisineSpec) -> Excitation:
    """The multisine whose phases spread its samples evenly over the working range."""
    return _multisine(HOMOGENISED, spec)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FoundPhases:
    """Phases of a multisine as it is played, in turns: what a search has found need not be sought again."""

    displacement: NDArray[np.float64]  # (K,)
    current: NDArray[np.float64] | None  # (K',); None where none is played


def phases_of(excitation: Excitation) -> FoundPhases:
    """The phases of a designed multisine. Raises DesignError where it keeps samples instead."""
    motion, current = excitation.sources or (None, None)
    if not isinstance(motion, Repeated) or not isinstance(current, Repeated | None):
        raise DesignError(f"{excitation!r} keeps samples and no phases: design it again")
    return FoundPhases(
        displacement=motion.tones.phase_turns, current=None if current is None else current.tones.phase_turns
    )


def excitation_of_phases(config: Mapping[str, JSON], phases: FoundPhases, where: str) -> Excitation:
    """The multisine that ``config`` describes, with phases that are known; it has no figures. Raises DesignError."""
    try:
        parameters = {key: value for key, value in config.items() if key != "kind"}
        spec = with_record(to_spec(MultisineSpec, _completed(parameters)))[0]
        motion, current = displacement_tones(spec), current_tones(spec)
        motion = _with_phases("displacement", motion, phases.displacement)
        current = None if current is None else _with_phases("current", current, phases.current)
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            period = fitted(spec, motion, current)
        return repeated(spec, period, {"kind": config["kind"], **to_config(spec)}, {})
    except DesignError as error:
        raise error.below(where) from error


def _with_phases(name: str, tones: Multitone, phases: NDArray[np.float64] | None) -> Multitone:
    if phases is None or phases.size != tones.lines.size:
        count = 0 if phases is None else phases.size
        raise DesignError(f"{name} has {count} phases: its design has {tones.lines.size} lines: write the plan again")
    return tones.with_phases(phases)


def _multisine(kind: str, spec: MultisineSpec) -> Excitation:
    if kind == HOMOGENISED:
        spec = replace(spec, homogenise=spec.homogenise or HomogeniseSpec())
    spec, record = with_record(spec)
    period = homogenised(spec) if kind == HOMOGENISED else random_phase(spec)
    made = as_excitation(spec, period, kind)
    more: dict[str, JSON] = {}
    if kind == HOMOGENISED:
        more["coverage_before"] = covered(spec, random_phase(spec)).index
    if record is not None:
        more |= service_figures(spec, period, record)
    return made.with_figures(more)
