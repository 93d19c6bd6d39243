"""The second generator of hidden effects: machines as they are built, recorded as they are recorded.

Seeds below 100 000 are for development, seeds from 900 000 on are sealed: what is reported was never used for tuning.
Nothing here shares an equation with `identification`, nor a force law with `benchmarks.hidden`. Which effects a case
shows is decided before any identification sees it (`sizing`).
"""

from benchmarks.machines.case import Case, case
from benchmarks.machines.kinds import KINDS
from benchmarks.machines.storage import truth_of, write_case

__all__ = ["KINDS", "Case", "case", "truth_of", "write_case"]
