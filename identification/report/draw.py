"""report.html, drawn from report.json and evidence.h5 alone."""

from __future__ import annotations

from pathlib import Path

from excitation.atomic import written_whole
from identification.errors import OutputError, ReportFileError
from identification.report.evidence_file import read_evidence
from identification.report.page import page
from identification.report.page_data import PageData
from identification.report.report_file import Report, read_report

REPORT, EVIDENCE, PAGE = "report.json", "evidence.h5", "report.html"


def draw_report(directory: Path) -> Path:
    """Draw the page of the report in `directory`, whole or not at all; returns its path.

    Nothing is simulated or judged: the same two files give the same page, to the byte.

    Raises
    ------
    ReportFileError
        when one of the two can't be used, or they are not of one explanation.
    """
    report, fingerprint = read_report(directory / REPORT)
    data = read_evidence(directory / EVIDENCE)
    _check(directory, report, fingerprint, data)
    with written_whole(directory / PAGE, OutputError) as temporary:
        temporary.write_text(page(report, data), encoding="utf-8")
    return directory / PAGE


def _check(directory: Path, report: Report, fingerprint: str, data: PageData) -> None:
    if data.report != fingerprint:
        raise ReportFileError(
            f"{directory / EVIDENCE}: belongs to another {REPORT} than the one beside it: explain again"
        )
    runs = len(report.runs.train)
    if data.strengths is not None and data.strengths.values.shape[1] != runs:
        raise ReportFileError(
            f"{directory / EVIDENCE}: /strengths/values has shape {data.strengths.values.shape}: "
            f"a column for each of the {runs} training runs is due"
        )
