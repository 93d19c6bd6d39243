"""The file of a search for regressors: its path, and all that was tried, so that it goes on after an interruption."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from excitation.untrusted import parse_json
from identification.blackbox.fields import number_in, object_in
from identification.blackbox.model import Member
from identification.blackbox.modelfile import member_from_json, member_to_json
from identification.blackbox.samples import Course
from identification.blackbox.selection import Known, Step, Tried
from identification.errors import DataError, ModelError
from identification.models.modelfile import Json, shown, type_of, write_json

FORMAT = "damper-rig/selection"


def digest_of(courses: Sequence[Course]) -> str:
    """What the training says, in a few letters: a search goes on with the same only."""
    found = hashlib.sha256()
    for course in courses:
        for series in (course.motion.x, course.motion.v, course.motion.i, course.force):
            found.update(np.ascontiguousarray(series).tobytes())
    return found.hexdigest()[:16]


def write_selection(path: Path, courses: Sequence[Course], steps: Sequence[Step], known: Known) -> None:
    """Write the path and all that was tried, whole or not at all; raises ModelFileError."""
    data: dict[str, Json] = {
        "format": FORMAT,
        "format_version": 1,
        "training": digest_of(courses),
        "path": [
            {"act": one.act, "regressors": _names(one.tried), "rrmsse": one.tried.rrmsse, "tried": one.count}
            for one in steps
        ],
        "tried": [
            {"error": one.error, "network": member_to_json(Member(one.structure, one.weights))}
            for one in known.values()
        ],
    }
    write_json(path, data)


def read_selection(path: Path, courses: Sequence[Course]) -> dict[str, Tried]:
    """What was tried before by the search of a file, none where there is no file; raises DataError."""
    if not path.exists():
        return {}
    try:
        data = object_in("the file", parse_json(path.read_bytes()))
        if data.get("format") != FORMAT:
            raise ModelError(f"format is {shown(data.get('format'))}: a search has '{FORMAT}'")
        if data.get("training") != digest_of(courses):
            raise ModelError("it belongs to other runs: name another file, or remove it")
        tried = data.get("tried", [])
        if not isinstance(tried, list):
            raise ModelError(f"tried is {type_of(tried)}: it must be a list")
        return {str(one.structure): one for one in (_tried(k, part) for k, part in enumerate(tried))}
    except (ModelError, OSError) as error:
        raise DataError(f"{path}: {error}") from error
    except ValueError as error:
        raise DataError(f"{path}: not the JSON of a search: name another file, or remove it") from error


def _tried(k: int, data: Json) -> Tried:
    part = object_in(f"tried[{k}]", data)
    member = member_from_json(f"tried[{k}].network", part.get("network"))
    error = number_in(f"tried[{k}].error", part.get("error"))
    if error < 0.0:
        raise ModelError(f"tried[{k}].error is {error:g}: a mean square is not below 0")
    return Tried(member.structure, error, member.weights)


def _names(tried: Tried) -> list[str]:
    return [str(one) for one in tried.structure.regressors]
