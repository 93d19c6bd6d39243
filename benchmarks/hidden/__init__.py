"""Hidden cases, by laws that are not the catalogue's: random specimens with effects that a given simulation lacks."""

from benchmarks.hidden.bench import Bench, bench
from benchmarks.hidden.case import KINDS, Case, case
from benchmarks.hidden.conditions import STANDARD, Conditions, OutOfReach
from benchmarks.hidden.storage import write_case

__all__ = ["KINDS", "STANDARD", "Bench", "Case", "Conditions", "OutOfReach", "bench", "case", "write_case"]
