"""Hidden cases by another author: random specimens with one or more effects that a given simulation lacks."""

from benchmarks.hidden.case import KINDS, Case, case
from benchmarks.hidden.conditions import STANDARD, Conditions, OutOfReach
from benchmarks.hidden.storage import write_case

__all__ = ["KINDS", "STANDARD", "Case", "Conditions", "OutOfReach", "case", "write_case"]
