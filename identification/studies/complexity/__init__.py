"""Complexity: what each characteristic of a damper model is worth in the vehicle, and how simple the model may be."""

from identification.studies.complexity.described import complexity_data, complexity_text, plan_of_tests
from identification.studies.complexity.page import write_complexity
from identification.studies.complexity.plan import BogieStep, Plan, RoadStep, SeatStep, Step
from identification.studies.complexity.result import Complexity
from identification.studies.complexity.study import complexity

__all__ = [
    "BogieStep",
    "Complexity",
    "Plan",
    "RoadStep",
    "SeatStep",
    "Step",
    "complexity",
    "complexity_data",
    "complexity_text",
    "plan_of_tests",
    "write_complexity",
]
