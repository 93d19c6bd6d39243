"""Exploration: which parameter sets a model may have so that it behaves like the measured tests."""

from identification.studies.exploration.asked import Exploration, Limits
from identification.studies.exploration.described import explored_data, explored_text
from identification.studies.exploration.explore import check_explorable, explore
from identification.studies.exploration.page import write_explored
from identification.studies.exploration.result import CRITERIA, Explored

__all__ = [
    "CRITERIA",
    "Exploration",
    "Explored",
    "Limits",
    "check_explorable",
    "explore",
    "explored_data",
    "explored_text",
    "write_explored",
]
