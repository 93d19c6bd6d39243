"""The page of a discrepancy report, drawn from its two files: nothing here simulates, fits or judges."""

from identification.report.draw import draw_report
from identification.report.evidence_file import read_evidence, write_evidence
from identification.report.lines import report_lines
from identification.report.page_data import PageData
from identification.report.report_file import Report, fingerprint, read_report

__all__ = [
    "PageData",
    "Report",
    "draw_report",
    "fingerprint",
    "read_evidence",
    "read_report",
    "report_lines",
    "write_evidence",
]
