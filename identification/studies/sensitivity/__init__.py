"""Sensitivity: how much each parameter of a model changes its force, by a network, by variance and locally."""

from identification.studies.sensitivity.asked import Sensitivity
from identification.studies.sensitivity.described import sensitivity_data, sensitivity_text
from identification.studies.sensitivity.page import write_sensitivity
from identification.studies.sensitivity.result import Sensitive
from identification.studies.sensitivity.study import at_run, check_sensitivity, sensitivity

__all__ = [
    "Sensitive",
    "Sensitivity",
    "at_run",
    "check_sensitivity",
    "sensitivity",
    "sensitivity_data",
    "sensitivity_text",
    "write_sensitivity",
]
