"""What an explanation leaves in a folder: report.json, evidence.h5, model.json and the page that is drawn of them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from excitation.atomic import written_whole
from excitation.plan import plan_from_config
from excitation.plan_files import write_plan
from identification.discrepancy.curves import page_data
from identification.discrepancy.explanation import Explanation, report_data
from identification.errors import OutputError
from identification.physical.modelfile import write_model
from identification.report import draw_report, write_evidence
from rigctl.runfile import Run


def write_report(explanation: Explanation, directory: Path, *, reproduce: str = "", runs: Sequence[Run] = ()) -> Path:
    """Write model.json, evidence.h5 and report.json into `directory`, draw report.html, and return its path.

    Where a further test is worth its rig time, next_test.toml is a plan of that test, ready for `damper-rig run`.
    `reproduce` is the command that makes the report again. `runs` are those that were explained: where there are
    steady sines among them, their characteristic sheet is a part of the page. Each file is complete under its name, or
    not there.
    """
    directory.mkdir(parents=True, exist_ok=True)
    (directory / "next_test.toml").unlink(missing_ok=True)
    if design := explanation.next_test.design:
        write_plan(directory / "next_test.toml", plan_from_config({"tests": [dict(design)]}))
    write_model(directory / "model.json", explanation.model)
    write_evidence(directory / "evidence.h5", page_data(explanation, reproduce=reproduce, runs=runs))
    with written_whole(directory / "report.json", OutputError) as temporary:
        data = json.dumps(report_data(explanation), indent=2, ensure_ascii=False, allow_nan=False)
        temporary.write_text(data + "\n", encoding="utf-8")
    return draw_report(directory)
