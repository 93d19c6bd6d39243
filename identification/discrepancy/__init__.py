"""From a gap between simulation and measurement to the name of what is missing."""

from identification.discrepancy.explain import explain
from identification.discrepancy.explanation import Explanation, Verdict, report_data
from identification.discrepancy.foreign import explain_any, questions
from identification.discrepancy.preparation import prepared
from identification.discrepancy.report import write_report

__all__ = [
    "Explanation",
    "Verdict",
    "explain",
    "explain_any",
    "prepared",
    "questions",
    "report_data",
    "write_report",
]
