"""Numbers of all nodes as one value, computed four at once.

A loop over nodes is short, and its length is known when it is compiled: the compiler writes it out before it could be
vectorised, and computes the numbers one by one. Here they are vectors of the processor from the start. `nodes` is a
tuple of as many entries as there are nodes, a multiple of four; a linear model has none.
"""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, models, register_model

from identification.blackbox.four import DOUBLES, Four, repeated
from identification.blackbox.structure import LANES

_ALIGNED = 8  # bytes: what a kernel takes begins at any number of an array


class Lanes(types.Type):
    """So many vectors of four doubles."""

    def __init__(self, count):
        self.count = count
        super().__init__(name=f"Lanes({count})")


@register_model(Lanes)
class _Vectors(models.PrimitiveModel):
    def __init__(self, manager, lanes):
        super().__init__(manager, lanes, ir.ArrayType(DOUBLES, lanes.count))


def parts(builder, value):
    """The vectors of which a value of lanes consists."""
    return [Four(builder, builder.extract_value(value, k)) for k in range(value.type.count)]


def joined(builder, fours):
    """A value of lanes of its vectors."""
    return cgutils.pack_array(builder, [one.value for one in fours], DOUBLES)


@intrinsic
def taken(context, array, first, nodes):
    """The entries of a contiguous array from `first` on, one for each node."""
    lanes = Lanes(len(nodes) // LANES)

    def load(context, builder, signature, values):
        places = _places(context, builder, signature, values, lanes.count)
        return joined(builder, [Four(builder, builder.load(place, align=_ALIGNED)) for place in places])

    return lanes(array, types.intp, nodes), load


@intrinsic
def put(context, array, first, lanes):
    """Writes the numbers to a contiguous array, from `first` on."""

    def store(context, builder, signature, values):
        places = _places(context, builder, signature, values, lanes.count)
        for place, one in zip(places, parts(builder, values[2]), strict=True):
            builder.store(one.value, place, align=_ALIGNED)
        return context.get_dummy_value()

    return types.void(array, types.intp, lanes), store


@intrinsic
def scaled(context, lanes, factor):
    """Each number times a factor."""

    def multiply(context, builder, signature, values):
        factor = repeated(builder, values[1])
        return joined(builder, [one * factor for one in parts(builder, values[0])])

    return lanes(lanes, types.float64), multiply


@intrinsic
def added(context, lanes, others, factor):
    """Each number and a factor times the other one."""

    def add(context, builder, signature, values):
        factor = repeated(builder, values[2])
        return joined(builder, [one + other * factor for one, other in _pairs(builder, values)])

    return lanes(lanes, lanes, types.float64), add


@intrinsic
def product(context, lanes, others):
    """Each number times the other one."""

    def multiply(context, builder, signature, values):
        return joined(builder, [one * other for one, other in _pairs(builder, values)])

    return lanes(lanes, lanes), multiply


@intrinsic
def inner(context, lanes, others):
    """The sum of their products."""

    def add(context, builder, signature, values):
        products = [one * other for one, other in _pairs(builder, values)]
        return sum(products, start=repeated(builder, DOUBLES.element(0.0))).total()

    return types.float64(lanes, lanes), add


def _pairs(builder, values):
    return zip(parts(builder, values[0]), parts(builder, values[1]), strict=True)


def _places(context, builder, signature, values, count):
    """Where each vector of four begins in an array."""
    array = context.make_array(signature.args[0])(context, builder, values[0])
    begins = [builder.add(values[1], values[1].type(LANES * k)) for k in range(count)]
    return [builder.bitcast(builder.gep(array.data, [begin]), DOUBLES.as_pointer()) for begin in begins]
