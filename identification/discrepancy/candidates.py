"""Which elements might be missing, and the first values of each within what the data span."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from identification.criteria import FORM
from identification.physical.beside import switched, switches
from identification.physical.elements import CATALOGUE, Growth, Values
from identification.physical.model import Element, Model, Parameter, element
from identification.record import Record
from identification.scales import Scales


def guesses(name: str, scales: Scales, *, mounted: bool = False) -> list[Element]:
    """Elements of one name with first values worth trying, each shape limited to what the data span; of what may act
    beside the mount of a model that is `mounted`, both ways."""
    spec = CATALOGUE[name]
    if spec.starts is None:
        return []
    within = [_first(name, values, scales) for values in spec.starts(scales)]
    return within + [switched(e, k) for k in switches(spec, beside=True) if mounted for e in within]


def starts_out_of(fitted: Element, name: str, growth: Growth, scales: Scales) -> list[Element]:
    """Elements of a name that start out of another one that fits, and are as fine where it is."""
    own = {s.name for s in CATALOGUE[name].parameters}
    pairs = zip(fitted.spec.parameters, fitted.parameters, strict=True)
    finer = {s.name: p for s, p in pairs if s.refinement and s.name in own}
    return [_with(_first(name, values, scales), finer) for values in growth.starts(fitted.values(), scales)]


def _first(name: str, values: Values, scales: Scales) -> Element:
    """An element with first values; those of an element that fits may lie on a bound, and shares of them beyond it."""
    bounds = {s.name: (s.low, s.high) for s in CATALOGUE[name].parameters}
    inside = {n: min(max(v, bounds[n][0]), bounds[n][1]) for n, v in values.items()}
    return _limit(element(name, inside, CATALOGUE[name].held), scales)


def _with(e: Element, own: Mapping[str, Parameter]) -> Element:
    pairs = zip(e.spec.parameters, e.parameters, strict=True)
    return replace(e, parameters=tuple(own.get(s.name, p) for s, p in pairs))


def _limit(e: Element, scales: Scales) -> Element:
    limited = {}
    for spec, p in zip(e.spec.parameters, e.parameters, strict=True):
        if spec.limits is not None and not (spec.refinement and p.fixed):
            low, high = spec.limits(scales)
            limited[spec.name] = replace(p, value=min(max(p.value, low), high), low=low, high=high)
    return _with(e, limited)


def remove_limits(e: Element) -> Element:
    """The element without the limits that only the search needed."""
    return replace(e, parameters=tuple(replace(p, low=None, high=None) for p in e.parameters))


def at_limit(e: Element) -> bool:
    """Whether a free parameter lies on a limit of the search, or on a bound of its own that no case of it means."""
    for spec, p in zip(e.spec.parameters, e.parameters, strict=True):
        low, high = spec.low if p.low is None else p.low, spec.high if p.high is None else p.high
        own = (p.low is not None or p.high is not None) or not spec.bound_is_meant
        if not p.fixed and own and not low < p.value < high:
            return True
    return False


def admissible(model: Model, records: Sequence[Record], scales: Scales) -> list[str]:
    """Names that might be added to `model` and that these records could show at all.

    Left out: what the model has, or has a finer shape for; what acts on a current or a temperature that does not vary;
    a constant force beside a free one or a free preload, which is the same thing; on top of a foreign simulation all
    that changes its inside. Elements that are found in another way, such as a tone, have no first values here.
    """
    foreign = any(r.simulated is not None for r in records)  # whose inside nobody can reach
    current = any(r.has_current for r in records) and scales.current_high > scales.current_low
    warm, constant = _temperature_varies(records), _free_constant(model)
    acting, names = {e.name for e in model.elements if not _idle(e)}, []
    for name, spec in CATALOGUE.items():
        taken = name in acting or (spec.once and model.has(name)) or not acting.isdisjoint(spec.finer_of)
        blind = spec.needs_current and not (current and (spec.path != "control" or model.needs_current))
        cold = spec.needs_temperature and not warm
        hidden = spec.constant_force and constant
        out_of_reach = foreign and not spec.adds
        if spec.nameable and spec.starts is not None and not (taken or blind or cold or hidden or out_of_reach):
            names.append(name)
    return names


def _idle(e: Element) -> bool:
    """Whether it makes no force, and no fit lets it: zero, and its finer shape neutral."""
    pairs = zip(e.spec.parameters, e.parameters, strict=True)
    return all(p.fixed and p.value == ((s.default or 0.0) if s.refinement else 0.0) for s, p in pairs)


def _temperature_varies(records: Sequence[Record]) -> bool:
    values = [r.motion.temperature for r in records if r.has_temperature]
    return bool(values) and max(v.max() for v in values) - min(v.min() for v in values) > FORM.varying_temperature


def _free_constant(model: Model) -> bool:
    return any((p := e.spec.parameters[k]).outside or p.preload for e, k in model.slots() if not e.parameters[k].fixed)
