"""Finer shapes: a real friction builds up and a real hysteresis reverses gradually, where the canonical forms jump."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

from identification.criteria import BUDGET, CHANCE, FORM
from identification.errors import SimulationError
from identification.fitting.leastsquares import Fit, fit_records
from identification.physical.beside import switched, switches
from identification.physical.elements import ParameterSpec, Values
from identification.physical.model import Element, Model, Parameter, denies_its_name, neutral
from identification.record import Record
from identification.scales import Scales, scales_of


def refine_curve(fit: Fit, index: int, records: Sequence[Record], *, gains: bool = True, named: bool = False) -> Fit:
    """The fit with the finer shape of one element free, where it has one and the data show it; else as it is.

    The same, with `gains`, with its gain on the current. Of the two the one that explains more comes first. Before
    them, a friction that may act beside the mount is tried there. Some shapes are for an element that is `named`, and
    start from what the others have come to.
    """
    row = fit.model.elements[index].spec
    specs = row.parameters
    fit = beside_or_within(fit, index, records)
    fit = _switched(fit, index, switches(row, beside=False), records)
    scales = scales_of(records, fit.rms)
    gains = gains and any(r.has_current for r in records)
    grows = {k: Parameter(value=0.0) for k, s in enumerate(specs) if s.refinement and s.gain and gains}
    fit = _best_first(fit, index, [*_shapes(fit.model.elements[index], scales, late=False), grows], records)
    return _best_first(fit, index, _shapes(fit.model.elements[index], scales, late=True), records) if named else fit


def _shapes(own: Element, scales: Scales, *, late: bool) -> list[dict[int, Parameter]]:
    """First values of each finer shape of an element, by their places."""
    ways: dict[str, dict[int, Parameter]] = {}
    for k, s in enumerate(own.spec.parameters):
        first = _start(s, own.values(), scales) if s.refinement and not (s.gain or s.switch) else None
        if first is not None and s.late == late:
            ways.setdefault(s.shape, {})[k] = first
    return list(ways.values())


def _best_first(fit: Fit, index: int, ways: list[dict[int, Parameter]], records: Sequence[Record]) -> Fit:
    """The fit with what the data show of these free, that which explains most first."""
    while ways:
        finer = [_freed(fit, index, way, records) for way in ways]
        best = min(range(len(ways)), key=lambda k: finer[k].chi2)
        fit = finer[best]
        del ways[best]
    return fit


def without_needless_shape(fit: Fit, index: int, records: Sequence[Record]) -> Fit:
    """The fit with the finer shape of one element neutral again, where that was free from the start and the data do not
    show it."""
    own = fit.model.elements[index]
    shaped = [s.refinement and not s.switch for s in own.spec.parameters]
    if all(p.fixed for p, finer in zip(own.parameters, shaped, strict=True) if finer):
        return fit
    plain = tuple(neutral(s) if finer else p
                  for s, p, finer in zip(own.spec.parameters, own.parameters, shaped, strict=True))  # fmt: skip
    found = _refitted(fit, index, plain, records)
    shown = max(CHANCE.slack, FORM.helps * (found.chi2 - found.samples))
    return fit if fit.chi2 < found.chi2 - shown else found


def beside_or_within(fit: Fit, index: int, records: Sequence[Record]) -> Fit:
    """The fit with one element beside the mount, or within it again, where that is clearly the better."""
    mounted = bool(fit.model.on("mount"))
    return _switched(fit, index, switches(fit.model.elements[index].spec, beside=True) if mounted else (), records)


def _switched(fit: Fit, index: int, places: Sequence[int], records: Sequence[Record]) -> Fit:
    """The fit with one of these switches of an element the other way, where that is clearly the better."""
    own, excess = fit.model.elements[index], fit.chi2 - fit.samples
    if excess < CHANCE.at_noise * fit.samples:
        return fit
    for place in places:
        moved = _refitted(fit, index, switched(own, place).parameters, records)
        if moved.chi2 < fit.chi2 - max(CHANCE.slack, FORM.helps * excess):
            return moved
    return fit


def _freed(fit: Fit, index: int, first: Mapping[int, Parameter], records: Sequence[Record]) -> Fit:
    """The fit with some parameters of one element free from their first values, where it is clearly the better.

    What else of its finer shape is free goes where these alone fit as well: it was freed when the model lacked more.
    """
    own = fit.model.elements[index]
    finer = [k for k in first if own.parameters[k].fixed]
    excess = fit.chi2 - fit.samples
    if not finer or excess < CHANCE.at_noise * fit.samples:
        return fit
    beside = tuple(first[k] if k in finer else p for k, p in enumerate(own.parameters))
    alone = tuple(neutral(s) if s.refinement and not s.switch and k not in finer else p
                  for k, (s, p) in enumerate(zip(own.spec.parameters, beside, strict=True)))  # fmt: skip
    shaped = [_refitted(fit, index, parameters, records) for parameters in dict.fromkeys((alone, beside))]
    least = min(s.chi2 for s in shaped)
    best = next(s for s in shaped if s.chi2 <= least + CHANCE.slack)
    return best if best.chi2 < fit.chi2 - max(CHANCE.slack, FORM.helps * excess) else fit


def _refitted(fit: Fit, index: int, parameters: tuple[Parameter, ...], records: Sequence[Record]) -> Fit:
    """The fit with other parameters of one element; as it is where the model can't run with them, or where they deny
    the element's name."""
    elements = list(fit.model.elements)
    elements[index] = replace(elements[index], parameters=parameters)
    model = replace(fit.model, elements=tuple(elements))
    with suppress(SimulationError):
        finer = fit_records(model, records, max_iterations=BUDGET.fit_iterations, tolerance=BUDGET.flat)
        before, after = (denies_its_name(f.model.elements[index], f.model) for f in (fit, finer))
        return finer if before or not after else fit
    return fit


def refine_curves(fit: Fit, records: Sequence[Record], *, gains: bool = True) -> Fit:
    """The fit with every finer shape free that the data show; with `gains`, what grows with the current too."""
    for index in range(len(fit.model.elements)):
        fit = refine_curve(fit, index, records, gains=gains, named=True)
    return fit


def follows_current(model: Model) -> bool:
    """Whether the force of a core follows the current: then that of what is missing may too.

    Else a bend that grows with the current, and a slope that makes up for it, are a yield force that does.
    """
    return any(
        e.spec.needs_current
        or any(s.gain and p.value != 0.0 for s, p in zip(e.spec.parameters, e.parameters, strict=True))
        for e in model.on("core")
    )


def with_shapes_of(model: Model, fitted: Model) -> Model:
    """`model` with the finer shapes that its elements have in `fitted`, which holds at least the same elements."""
    elements = []
    for own in model.elements:
        pairs = zip(own.spec.parameters, own.parameters, fitted.element(own.id).parameters, strict=True)
        elements.append(replace(own, parameters=tuple(q if s.refinement else p for s, p, q in pairs)))
    return replace(model, elements=tuple(elements))


def _start(spec: ParameterSpec, own: Values, scales: Scales) -> Parameter | None:
    """First value and limits of a build-up: at zero its gradient vanishes, and a step that lands there would stay.

    A share has a gradient there, and a lag that of a dead time. What has limits of the search starts between them. None
    where these records can't show it.
    """
    if spec.begins is not None:
        first = spec.begins(own, scales)
        return None if first is None else Parameter(value=first)
    if spec.limits is not None:
        low, high = spec.limits(scales)
        return Parameter(value=0.5 * (low + high), low=low, high=high)
    typical = {
        "m/s": scales.speeds[0],
        "m": FORM.minor * scales.x_rms,
        "N": scales.force,
        "s": scales.motion_time,
        "1/s": (scales.motion_time * scales.duration) ** -0.5,
    }
    scale = typical.get(spec.unit, 0.0)
    if scale == 0.0:
        return Parameter(value=0.0)
    return Parameter(value=BUDGET.build_up * scale, low=CHANCE.visible * scale, high=FORM.disproportionate * scale)
