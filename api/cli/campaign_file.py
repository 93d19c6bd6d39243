"""The file of a campaign for a service, and the names of the run files that come back."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from api.client import RunFile
from api.client.download import file_name
from api.errors import InputError, one_line
from excitation import TestPlan, plan_from_config, read_plan, write_plan
from excitation.plan_files import PLAN_FORMAT, VERSION, holds_a_plan, located
from excitation.synthesis import reads_a_file

__all__ = ["is_sent", "names_of", "read_campaign", "sendable"]

SENT = (".h5", ".csv", ".mat", ".drv", ".rsp")


def read_campaign(file: Path, **given: str | None) -> dict[str, Any]:
    """The body of POST /v1/campaigns: the keys of a TOML or JSON file, and above them what is given. Any: JSON.

    Of a file that is sent as it is (`is_sent`), only what is given. The service checks it. Raises InputError, one line,
    where the file cannot be read or a rig or specimen is missing.
    """
    body = {"name": file.stem} | ({} if is_sent(file) else _keys(file))
    body |= {key: value for key, value in given.items() if value is not None}
    for key in ("rig", "specimen"):
        if key not in body:
            raise InputError(f"{file}: {key} is missing: {'' if is_sent(file) else 'add it, or '}give --{key}")
    return body


def is_sent(file: Path) -> bool:
    """Whether it is a plan or excitation file that the service reads itself."""
    return file.suffix.lower() in SENT


@contextmanager
def sendable(file: Path, body: Mapping[str, Any]) -> Iterator[tuple[Path | None, dict[str, Any]]]:
    """What is sent as a file, None where nothing is, and the body beside it. Any: JSON.

    A plan that replays records of this computer is sent with their samples. Raises DesignError or ExcitationFileError
    where they cannot be read.
    """
    plan = _replaying(file, body)
    if plan is None:
        yield (file if is_sent(file) else None), dict(body)
        return
    with TemporaryDirectory() as folder:
        whole = Path(folder) / f"{file.stem}.h5"
        write_plan(whole, plan, whole=True)
        yield whole, {key: value for key, value in body.items() if key not in ("tests", "warm_up")}


def _replaying(file: Path, body: Mapping[str, Any]) -> TestPlan | None:
    """The plan, if a test of it reads a file."""
    if not is_sent(file):
        config = located({key: body[key] for key in ("tests", "warm_up") if key in body}, file.parent)
        given = [*config["tests"], config.get("warm_up")] if isinstance(config["tests"], (list, tuple)) else []
        reads = any(isinstance(one, Mapping) and reads_a_file(one) for one in given)
        return plan_from_config(config) if reads else None
    if not (file.is_file() and holds_a_plan(file)):
        return None
    plan = read_plan(file)
    reads = any(test.excitation.sources and reads_a_file(test.excitation.design) for test in plan.tests)
    return plan if reads else None


def _keys(file: Path) -> dict[str, Any]:
    try:
        text = file.read_text(encoding="utf-8")
        body = json.loads(text) if file.suffix == ".json" else tomllib.loads(text)
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{file}: cannot be read as a campaign: {one_line(error)}") from error
    if not isinstance(body, dict) or "tests" not in body:
        raise InputError(f"{file}: has no tests: give the keys of POST /v1/campaigns, or a plan")
    layout, version = body.pop("format", PLAN_FORMAT), body.pop("format_version", VERSION)
    if (layout, version) != (PLAN_FORMAT, VERSION):
        raise InputError(f"{file}: format is {layout!r:.40} {version!r:.20}: a plan has {PLAN_FORMAT!r} {VERSION}")
    return body


def names_of(runs: Sequence[RunFile]) -> list[str]:
    """A file name for each run: that of its test, with the run's number where a test has several."""
    names: list[str] = []
    for run in runs:
        name, number = file_name(run), 1
        while name.lower() in (one.lower() for one in names):
            number += 1
            name = f"{file_name(run).removesuffix('.h5')}_{number}.h5"
        names.append(name)
    return names
