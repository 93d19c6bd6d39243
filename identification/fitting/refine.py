"""Finer shapes: a real friction builds up and a real hysteresis reverses gradually, where the canonical forms jump."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from identification.criteria import BUDGET, CHANCE, FORM
from identification.errors import SimulationError
from identification.fitting.leastsquares import Fit, fit_records
from identification.physical.model import Model, Parameter
from identification.record import Record
from identification.scales import scales_of


def refine_curve(fit: Fit, index: int, records: Sequence[Record]) -> Fit:
    """The fit with the finer shape of one element free, where it has one and the data show it; else as it is.

    The same with its gain on the current: how large the effect is may follow the current as the base does. Of the two
    the one that explains more comes first.
    """
    specs = fit.model.elements[index].spec.parameters
    shape = [k for k, s in enumerate(specs) if s.refinement and not s.gain]
    gains = [k for k, s in enumerate(specs) if s.refinement and s.gain and any(r.has_current for r in records)]
    ways = {tuple(shape): _start({specs[k].unit for k in shape}, records, fit.rms), tuple(gains): Parameter(value=0.0)}
    while ways:
        finer = {numbers: _freed(fit, index, numbers, free, records) for numbers, free in ways.items()}
        best = min(finer, key=lambda numbers: finer[numbers].chi2)
        fit = finer[best]
        del ways[best]
    return fit


def _freed(fit: Fit, index: int, numbers: Sequence[int], free: Parameter, records: Sequence[Record]) -> Fit:
    """The fit with some parameters of one element free, where it is clearly the better."""
    own = fit.model.elements[index]
    finer = [k for k in numbers if own.parameters[k].fixed]
    excess = fit.chi2 - fit.samples
    if not finer or excess < CHANCE.at_noise * fit.samples:
        return fit
    parameters = tuple(free if k in finer else p for k, p in enumerate(own.parameters))
    elements = list(fit.model.elements)
    elements[index] = replace(own, parameters=parameters)
    try:
        shaped = fit_records(
            replace(fit.model, elements=tuple(elements)),
            records,
            max_iterations=BUDGET.fit_iterations,
            tolerance=BUDGET.flat,
        )
    except SimulationError:
        return fit
    return shaped if shaped.chi2 < fit.chi2 - max(CHANCE.slack, FORM.helps * excess) else fit


def refine_curves(fit: Fit, records: Sequence[Record]) -> Fit:
    """The fit with every finer shape free that the data show."""
    for index in range(len(fit.model.elements)):
        fit = refine_curve(fit, index, records)
    return fit


def with_shapes_of(model: Model, fitted: Model) -> Model:
    """`model` with the finer shapes that its elements have in `fitted`, which holds at least the same elements."""
    elements = []
    for own in model.elements:
        pairs = zip(own.spec.parameters, own.parameters, fitted.element(own.id).parameters, strict=True)
        elements.append(replace(own, parameters=tuple(q if s.refinement else p for s, p, q in pairs)))
    return replace(model, elements=tuple(elements))


def _start(units: set[str], records: Sequence[Record], gap: float) -> Parameter:
    """First value and limits of a build-up: at zero its gradient vanishes, and a step that lands there would stay.

    A share has a gradient there.
    """
    if units == {"–"}:
        return Parameter(value=0.0)
    scales = scales_of(records, gap)
    scale = scales.speeds[0] if units == {"m/s"} else FORM.minor * scales.x_rms
    return Parameter(value=BUDGET.build_up * scale, low=CHANCE.visible * scale, high=FORM.disproportionate * scale)
