"""The hyperbolic tangent of the numbers of all nodes: no call, no branch, four at once."""

# Numba infers the types of these functions from their calls; annotations would not be read.
# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators

from __future__ import annotations

from numba.extending import intrinsic

from identification.blackbox.four import DOUBLES, WHOLES, Four
from identification.blackbox.lanes import joined, parts
from identification.blackbox.structure import LANES

_FAR = 40.0  # there tanh(½·40) is 1 to the last digit
_PER_OCTAVE = 1.4426950408889634  # 1/ln 2
_LN2_HIGH = 0.693147180369123816490  # ln 2 in two parts: their products with a whole number are exact
_LN2_LOW = 1.90821492927058770002e-10
_ROUNDS = 6755399441055744.0  # 1.5·2⁵²: added and taken away, it rounds to a whole number
_BIAS, _MANTISSA = 1023, 52  # of a double


@intrinsic
def tanh(context, lanes):
    """Their hyperbolic tangents, to 3e-15."""

    def compute(context, builder, signature, values):
        return joined(builder, [_tanh(one) for one in parts(builder, values[0])])

    return lanes(lanes), compute


def _tanh(z: Four) -> Four:
    """tanh z = 1 − 2/(exp 2z + 1); exp by powers of two and Taylor's series to r¹¹, |r| ≤ ½·ln 2."""
    t = (2.0 * z).at_most(_FAR).at_least(-_FAR)
    rounding = t * _PER_OCTAVE + _ROUNDS
    k = rounding - _ROUNDS
    r = (t - k * _LN2_HIGH) - k * _LN2_LOW
    q = r * r
    low = (1.0 + r) + q * (1 / 2 + r * (1 / 6))
    middle = (1 / 24 + r * (1 / 120)) + q * (1 / 720 + r * (1 / 5040))
    high = (1 / 40320 + r * (1 / 362880)) + q * (1 / 3628800 + r * (1 / 39916800))
    series = low + (q * q) * (middle + (q * q) * high)
    return 1.0 - 2.0 / (series * _power_of_two(rounding) + 1.0)


def _power_of_two(rounding: Four) -> Four:
    """2ᵏ from k + 1.5·2⁵²: the lowest bits of that sum are k. A conversion to a whole number would take longer."""
    builder = rounding.builder
    biased = builder.add(builder.bitcast(rounding.value, WHOLES), WHOLES([_BIAS] * LANES))
    return Four(builder, builder.bitcast(builder.shl(biased, WHOLES([_MANTISSA] * LANES)), DOUBLES))
