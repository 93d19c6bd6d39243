"""The file of a campaign for a service, and the names of the run files that come back."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from api.client import RunFile
from api.client.download import file_name
from api.errors import InputError, one_line

__all__ = ["is_sent", "names_of", "read_campaign"]

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


def _keys(file: Path) -> dict[str, Any]:
    try:
        text = file.read_text(encoding="utf-8")
        body = json.loads(text) if file.suffix == ".json" else tomllib.loads(text)
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{file}: cannot be read as a campaign: {one_line(error)}") from error
    if not isinstance(body, dict) or "tests" not in body:
        raise InputError(f"{file}: has no tests: give the keys of POST /v1/campaigns, or a plan")
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
