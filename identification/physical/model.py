"""A damper as named elements on four paths."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from identification.errors import ModelError
from identification.models.motion import Motion
from identification.models.protocol import TrainingRange
from identification.physical.elements import CATALOGUE, PATHS, ElementSpec, ParameterSpec, Path

if TYPE_CHECKING:
    from identification.physical.stepping import PhysicalStepper

_LABELLED: Final = re.compile(r"#[\w-]+")  # no dot: that stands between the id and a parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """A value, SI, with what is known of it."""

    value: float
    fixed: bool = False
    low: float | None = None
    high: float | None = None
    std: float | None = None


@dataclass(frozen=True, slots=True)
class Element:
    """One element of the catalogue; every parameter of its row has a value within physical bounds.

    Its `id` tells it from others of the same name in a model: the name, or the name, "#" and a label. `named` says that
    a search for missing effects has added it: a real effect may depart from its form by the tolerance of that search.
    """

    name: str
    parameters: tuple[Parameter, ...]
    id: str = ""  # where left out: the name
    named: bool = False

    def __post_init__(self) -> None:
        if self.name not in CATALOGUE:
            raise ModelError(f"element '{self.name}' is not in the catalogue: use one of {', '.join(CATALOGUE)}")
        if not self.id:
            object.__setattr__(self, "id", self.name)
        if self.id != self.name and not _LABELLED.fullmatch(self.id.removeprefix(self.name)):
            raise ModelError(f"id '{self.id}' is none of a '{self.name}': use '{self.name}' or '{self.name}#label'")
        if len(self.parameters) != len(self.spec.parameters):
            names = ", ".join(p.name for p in self.spec.parameters)
            raise ModelError(f"element '{self.name}' needs the parameters {names}")
        for spec, parameter in zip(self.spec.parameters, self.parameters, strict=True):
            _check(f"{self.name}.{spec.name}", spec.unit, parameter, spec.low, spec.high)
            if spec.switch and not (parameter.fixed and parameter.value in (0.0, 1.0)):
                raise ModelError(f"{self.name}.{spec.name} is {parameter.value:g}: it is 0 or 1, and fixed")

    @property
    def spec(self) -> ElementSpec:
        """Row of the catalogue."""
        return CATALOGUE[self.name]

    @property
    def told(self) -> list[tuple[ParameterSpec, Parameter]]:
        """The parameters that say something: all but those of finer shapes that are held at nothing."""
        pairs = zip(self.spec.parameters, self.parameters, strict=True)
        return [(s, p) for s, p in pairs if not (s.refinement and p.fixed and p.value == s.default)]

    @property
    def remembers(self) -> bool:
        """Whether the force depends on the past."""
        pairs = zip(self.spec.parameters, self.parameters, strict=True)
        return self.spec.memory or any(s.remembers and p.value != 0.0 for s, p in pairs)

    @property
    def warms(self) -> bool:
        """Whether the force depends on the temperature."""
        pairs = zip(self.spec.parameters, self.parameters, strict=True)
        return self.spec.needs_temperature or any(s.warms and p.value != 0.0 for s, p in pairs)

    def value(self, parameter: str) -> float:
        """Value of one parameter by name."""
        return self.parameters[self.spec.index(parameter)].value

    def values(self) -> dict[str, float]:
        """Value of every parameter by its name."""
        return {s.name: p.value for s, p in zip(self.spec.parameters, self.parameters, strict=True)}


def name_of(id_: str) -> str:
    """Name of the element that has this id.

    >>> name_of("viscous_damping#2")
    'viscous_damping'
    """
    return id_.partition("#")[0]


def _check(where: str, unit: str, parameter: Parameter, low: float, high: float) -> None:
    value = parameter.value
    if not math.isfinite(value):
        raise ModelError(f"{where} is {value}: it must be a finite number")
    if not low <= value <= high:
        raise ModelError(f"{where} is {value:g} {unit}: physically it lies within [{low:g}, {high:g}]")
    own_low = -math.inf if parameter.low is None else parameter.low
    own_high = math.inf if parameter.high is None else parameter.high
    if not own_low <= value <= own_high:
        raise ModelError(f"{where} is {value:g} {unit}: outside its own limits [{own_low:g}, {own_high:g}]")


def element(name: str, values: Mapping[str, float], fixed: Sequence[str] = ()) -> Element:
    """Make an element from plain values; what is left out takes the catalogue's default."""
    spec = CATALOGUE.get(name)
    if spec is None:
        raise ModelError(f"element '{name}' is not in the catalogue: use one of {', '.join(CATALOGUE)}")
    parameters = []
    for p in spec.parameters:
        default = p.constant if p.constant is not None else p.default
        value = values.get(p.name, default)
        if value is None:
            raise ModelError(f"element '{name}' lacks its parameter '{p.name}' ({p.unit})")
        held = p.constant is not None or p.name not in values or p.name in fixed
        parameters.append(Parameter(value=float(value), fixed=held))
    return Element(name, tuple(parameters))


@dataclass(frozen=True, slots=True, kw_only=True)
class Model:
    """A physical damper model: elements in order on mount, control, core and sensor, each with an id of its own.

    Of several that come under their name alone, all but the first get a number: `name#2`, `name#3`, …
    """

    name: str
    elements: tuple[Element, ...]

    def __post_init__(self) -> None:
        ordered = _told_apart(sorted(self.elements, key=lambda e: PATHS.index(e.spec.path)))
        object.__setattr__(self, "elements", tuple(ordered))
        for e in ordered:
            if e.spec.once and sum(other.name == e.name for other in ordered) > 1:
                raise ModelError(f"{e.spec.path} holds '{e.name}' more than once: join them into one element")
            if e.spec.alone and sum(other.spec.path == e.spec.path for other in ordered) > 1:
                raise ModelError(f"{e.spec.path} holds '{e.name}' beside another element: it stands alone there")
        if not any(e.spec.path == "core" for e in ordered):
            raise ModelError("core is empty: a damper needs at least one element that makes a force")

    def on(self, path: Path) -> tuple[Element, ...]:
        """Elements of one path, in order."""
        return tuple(e for e in self.elements if e.spec.path == path)

    def has(self, name: str) -> bool:
        """Whether an element of that name is part of the model."""
        return any(e.name == name for e in self.elements)

    @property
    def kind(self) -> str:
        """The kind of model in its file."""
        return "physical"

    @property
    def inputs(self) -> Mapping[str, str]:
        """Channels that a run must have to drive the model, and what needs each."""
        current = [f"'{e.name}'" for e in self.elements if e.spec.needs_current or is_controlled(e)]
        return {"displacement": "the model"} | ({"current": current[0]} if current else {})

    @property
    def training_range(self) -> TrainingRange | None:
        """None: a fitted model holds beyond its runs as far as its equations do."""
        return None

    def force(self, motion: Motion) -> NDArray[np.float64]:
        """Force along a motion, (N,), N; raises SimulationError as `simulate` does."""
        from identification.physical.simulate import simulate  # which is built on this module

        return simulate(self, motion).force

    def stepper(self, dt: float) -> PhysicalStepper:
        """The damper from sample to sample at the step `dt`, s; raises SimulationError where `dt` is none."""
        from identification.physical.stepping import PhysicalStepper  # which is built on this module

        return PhysicalStepper(self, dt)

    @property
    def needs_current(self) -> bool:
        """Whether the force depends on the control current."""
        return any(e.spec.needs_current or is_controlled(e) for e in self.elements)

    @property
    def ids(self) -> tuple[str, ...]:
        """Id of every element, in order."""
        return tuple(e.id for e in self.elements)

    def element(self, id_: str) -> Element:
        """The element that has this id.

        Raises
        ------
        ModelError
            when none has.
        """
        for e in self.elements:
            if e.id == id_:
                return e
        raise ModelError(f"'{self.name}' has no element '{id_}': it has {', '.join(self.ids)}")

    def numbered(self, new: Element) -> Element:
        """`new` under an id that no element of this model has."""
        return replace(new, id=_free_id(new.name, self.ids))

    def with_element(self, new: Element) -> Model:
        """The model with one more element at the end of its path, but before what acts on all that comes before it: a
        recorder that is late is late with the force of a mass too."""
        path, moves = new.spec.path, new.spec.moves_all
        late = [k for k, e in enumerate(self.elements) if e.spec.moves_all and e.spec.path == path and not moves]
        at = late[0] if late else len(self.elements)
        return replace(self, elements=(*self.elements[:at], new, *self.elements[at:]))

    def replacing(self, id_: str, new: Element) -> Model:
        """The model with another element in the place of one."""
        elements = [new if e.id == id_ else e for e in self.elements]
        return replace(self, elements=tuple(elements))

    def without(self, id_: str) -> Model:
        """The model without one of its elements; raises ModelError when it has none of that id."""
        gone = self.element(id_)
        return replace(self, elements=tuple(e for e in self.elements if e is not gone))

    def in_its_absence(self, id_: str) -> Model:
        """The same, also without the finer shapes that another element has only beside that one."""
        rest = self.without(id_)
        alone = [denies_its_name(e, rest) and not denies_its_name(e, self) for e in rest.elements]
        elements = [_canonical(e) if other else e for e, other in zip(rest.elements, alone, strict=True)]
        return replace(rest, elements=tuple(elements)) if any(alone) else rest

    def slots(self) -> Iterator[tuple[Element, int]]:
        """Every parameter in the order of the parameter vector, as (element, index within it)."""
        for e in self.elements:
            for k in range(len(e.parameters)):
                yield e, k

    def values(self) -> NDArray[np.float64]:
        """Parameter vector, (P,), SI."""
        return np.array([e.parameters[k].value for e, k in self.slots()], dtype=np.float64)

    def names(self) -> list[str]:
        """`id.parameter` for every entry of the parameter vector."""
        return [f"{e.id}.{e.spec.parameters[k].name}" for e, k in self.slots()]

    def free(self) -> NDArray[np.bool_]:
        """Which parameters a fit may move, (P,)."""
        return np.array([not e.parameters[k].fixed for e, k in self.slots()], dtype=np.bool_)

    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Physical bounds narrowed by the model's own, two arrays (P,)."""
        low, high = [], []
        for e, k in self.slots():
            spec, own = e.spec.parameters[k], e.parameters[k]
            low.append(spec.low if own.low is None else max(spec.low, own.low))
            high.append(spec.high if own.high is None else min(spec.high, own.high))
        return np.array(low), np.array(high)

    def with_values(self, values: Sequence[float] | NDArray[np.float64]) -> Model:
        """The model with another parameter vector, (P,)."""
        return self._map(  # at every step of a fit: `replace` takes ten times as long
            lambda p, i: Parameter(value=float(values[i]), fixed=p.fixed, low=p.low, high=p.high, std=p.std)
        )

    def with_std(self, std: Sequence[float] | NDArray[np.float64]) -> Model:
        """The model with standard deviations beside the values, (P,); NaN means unknown."""
        return self._map(lambda p, i: replace(p, std=float(std[i]) if math.isfinite(std[i]) else None))

    def _map(self, change: Callable[[Parameter, int], Parameter]) -> Model:
        elements, i = [], 0
        for e in self.elements:
            n = len(e.parameters)
            changed = tuple(change(p, i + k) for k, p in enumerate(e.parameters))
            elements.append(Element(e.name, changed, e.id, e.named))
            i += n
        return replace(self, elements=tuple(elements))


def _told_apart(elements: Sequence[Element]) -> Sequence[Element]:
    """The elements with an id each; raises ModelError where two were given the same label."""
    if len({e.id for e in elements}) == len(elements):
        return elements
    labelled = [e.id for e in elements if e.id != e.name]
    twice = {i for i in labelled if labelled.count(i) > 1}
    if twice:
        raise ModelError(f"id '{min(twice)}' is given more than once: give each element its own")
    taken, out = set(labelled), list[Element]()
    for e in elements:
        own = e if e.id in labelled or e.id not in taken else replace(e, id=_free_id(e.name, taken))
        taken.add(own.id)
        out.append(own)
    return out


def _free_id(name: str, taken: Collection[str]) -> str:
    """The name, or the name with the least number from 2 on, that is not taken yet."""
    return next(i for i in (name, *(f"{name}#{k}" for k in range(2, len(taken) + 3))) if i not in taken)


def neutral(spec: ParameterSpec) -> Parameter:
    """A parameter of a finer shape at nothing, and held there."""
    return Parameter(value=spec.default or 0.0, fixed=True)


def _canonical(e: Element) -> Element:
    """The element in its canonical form, its finer shape at nothing."""
    pairs = zip(e.spec.parameters, e.parameters, strict=True)
    return replace(e, parameters=tuple(neutral(s) if s.refinement else p for s, p in pairs))


def denies_its_name(own: Element, model: Model) -> bool:
    """Whether the values of an element, beside the others of its model, deny what its name says."""
    others = [e.spec for e in model.elements if e is not own]
    return own.spec.denied is not None and own.spec.denied(own.values(), others)


def is_controlled(e: Element) -> bool:
    """Whether a gain of the element on the current is not zero."""
    return any(p.value != 0.0 for spec, p in zip(e.spec.parameters, e.parameters, strict=True) if spec.gain)
