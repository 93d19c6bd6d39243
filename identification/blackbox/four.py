"""Four doubles at once while a loop is compiled: sums, products and choices of them, as instructions of the processor.

Only for functions that give the compiler its instructions: `lanes` and `tangent`.
"""

# llvmlite has no types.
# mypy: allow-untyped-calls

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from llvmlite import ir

from identification.blackbox.structure import LANES

DOUBLES, WHOLES = ir.VectorType(ir.DoubleType(), LANES), ir.VectorType(ir.IntType(64), LANES)
_INDEX = ir.IntType(32)
_LOOSE = ("contract", "nsz")  # as in `compiled`; no sum is taken in another order than it is written


@dataclass(frozen=True, slots=True)
class Four:
    """Four numbers, whose values are known when the loop runs."""

    builder: Any  # Any: of llvmlite, as `value`
    value: Any

    def __add__(self, other: Four | float) -> Four:
        return self._new(self.builder.fadd(self.value, self._like(other), flags=_LOOSE))

    def __radd__(self, other: float) -> Four:
        return self + other

    def __sub__(self, other: Four | float) -> Four:
        return self._new(self.builder.fsub(self.value, self._like(other), flags=_LOOSE))

    def __rsub__(self, other: float) -> Four:
        return self._new(self.builder.fsub(self._like(other), self.value, flags=_LOOSE))

    def __mul__(self, other: Four | float) -> Four:
        return self._new(self.builder.fmul(self.value, self._like(other), flags=_LOOSE))

    def __rmul__(self, other: float) -> Four:
        return self * other

    def __rtruediv__(self, other: float) -> Four:
        return self._new(self.builder.fdiv(self._like(other), self.value, flags=_LOOSE))

    def at_most(self, limit: float) -> Four:
        """Each, or the limit where it is not below that."""
        below = self.builder.fcmp_ordered("<", self.value, self._like(limit))
        return self._new(self.builder.select(below, self.value, self._like(limit)))

    def at_least(self, limit: float) -> Four:
        """Each, or the limit where it is not above that."""
        above = self.builder.fcmp_ordered(">", self.value, self._like(limit))
        return self._new(self.builder.select(above, self.value, self._like(limit)))

    def total(self) -> Any:  # Any: a number of llvmlite
        """Their sum."""
        one, two, three, four = (self.builder.extract_element(self.value, _INDEX(k)) for k in range(LANES))
        first = self.builder.fadd(one, three, flags=_LOOSE)
        return self.builder.fadd(first, self.builder.fadd(two, four, flags=_LOOSE), flags=_LOOSE)

    def _new(self, value: Any) -> Four:
        return Four(self.builder, value)

    def _like(self, other: Four | float) -> Any:
        return other.value if isinstance(other, Four) else ir.Constant(DOUBLES, [other] * LANES)


def repeated(builder: Any, number: Any) -> Four:
    """One number four times."""
    nothing = ir.Constant(DOUBLES, ir.Undefined)
    first = builder.insert_element(nothing, number, _INDEX(0))
    return Four(builder, builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(_INDEX, LANES), [0] * LANES)))
