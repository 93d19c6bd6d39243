"""Makes the samples of an excitation from its configuration, in which `kind` names the generator."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from excitation.checks import check_one_of
from excitation.configuration import to_spec
from excitation.errors import DesignError
from excitation.harmonic import SineSpec, StepsSpec, TriangleSpec, sine, steps, triangle
from excitation.homogenise import homogenised
from excitation.kinds import DESIGNED, HOMOGENISED, Kind
from excitation.multisine import as_excitation, covered, random_phase
from excitation.multisine_spec import HomogeniseSpec, MultisineSpec
from excitation.service import service_figures, with_record
from excitation.signal import JSON, Excitation

__all__ = ["SPECS", "excitation_from_config"]

SPECS: Mapping[str, type] = {  # what the keys of each kind are; one entry for each of DESIGNED
    Kind.MULTISINE.value: MultisineSpec,
    HOMOGENISED: MultisineSpec,
    Kind.SINE.value: SineSpec,
    Kind.TRIANGLE.value: TriangleSpec,
    Kind.STEPS.value: StepsSpec,
}


def excitation_from_config(config: Mapping[str, JSON], where: str = "") -> Excitation:
    """The excitation that ``config`` describes: `kind` is one of DESIGNED, the other keys are those of the kind.

    Raises DesignError, one line that begins with ``where``.
    """
    kind = config.get("kind")
    parameters = {key: value for key, value in config.items() if key != "kind"}
    try:
        check_one_of("kind", kind, DESIGNED)
        return _make(str(kind), parameters)
    except DesignError as error:
        raise error.below(where) from error


def _make(kind: str, config: Mapping[str, JSON]) -> Excitation:
    match kind:
        case Kind.SINE:
            return sine(to_spec(SineSpec, config))
        case Kind.TRIANGLE:
            return triangle(to_spec(TriangleSpec, config))
        case Kind.STEPS:
            return steps(to_spec(StepsSpec, config))
        case _:
            return _multisine(kind, to_spec(MultisineSpec, config))


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
    return replace(made, figures={**made.figures, **more})
