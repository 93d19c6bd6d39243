"""The configurations of the tests in a plan file from elsewhere: what the reading process does with one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

from excitation.errors import ExcitationError, ExcitationFileError
from excitation.plan import config_of
from excitation.plan_files import read_plan, read_plan_config
from excitation.untrusted import parse_json

__all__ = ["MOST_PLAN_BYTES", "plan_content"]

# Of the configurations as JSON: the text of a plan came in a body of 1 MiB at most, escapes make six bytes of one.
MOST_PLAN_BYTES: Final = 6 << 20


def plan_content(path: Path) -> dict[str, Any]:
    """``tests`` and ``warm_up`` as JSON (Any); of a plan as text nothing is designed.

    Raises ExcitationError, one line that names the file.
    """
    try:
        content = _of_samples(path) if path.suffix.lower() == ".h5" else _of_text(path)
        text = json.dumps(content)
        parse_json(text)  # TOML has nan; a value that is not JSON has ended the line before
    except ExcitationError:
        raise
    except (TypeError, ValueError) as error:
        reason = " ".join(str(error).split())[:160]
        raise ExcitationFileError(f"{path}: {reason}: a plan has texts, finite numbers and lists of them") from error
    except (RecursionError, MemoryError) as error:
        raise ExcitationFileError(f"{path}: nested too deeply, or too large: divide the plan into several") from error
    if len(text) > MOST_PLAN_BYTES:
        raise ExcitationFileError(f"{path}: its tests take {len(text)} bytes: at most {MOST_PLAN_BYTES} are kept")
    return content


def _of_text(path: Path) -> dict[str, Any]:
    config = read_plan_config(path)
    if further := sorted(set(config) - {"tests", "warm_up"}):
        raise ExcitationFileError(f"{path}: {further[0]!a:.60} is not a known key: known are tests, warm_up")
    tests, warm_up = config.get("tests"), config.get("warm_up")
    if not isinstance(tests, list) or not all(isinstance(test, dict) for test in tests):
        raise ExcitationFileError(f"{path}: tests is {str(tests)!a:.60}: it must be a list of tables")
    if warm_up is not None and not isinstance(warm_up, dict):
        raise ExcitationFileError(f"{path}: warm_up is {str(warm_up)!a:.60}: it must be a table")
    return {"tests": tests, "warm_up": warm_up}


def _of_samples(path: Path) -> dict[str, Any]:
    plan = read_plan(path)
    for test in (*plan.tests, *([] if plan.warm_up is None else [plan.warm_up])):
        if "kind" not in test.excitation.design:
            raise ExcitationFileError(
                f"{path}: test {test.name!a:.60} has samples but no design: the service keeps designs only"
            )
    return {
        "tests": [config_of(test) for test in plan.tests],
        "warm_up": None if plan.warm_up is None else config_of(plan.warm_up),
    }
