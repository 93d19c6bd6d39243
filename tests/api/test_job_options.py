"""Numbers and switches among the options of jobs: only JSON's own are taken, nothing that could be read as one."""

from __future__ import annotations

from dataclasses import fields
from typing import Any, get_args, get_type_hints

import pytest
from pydantic import TypeAdapter, ValidationError

from api.jobs.identify import IdentifyRequest
from api.jobs.kinds import AnyRequest

FOREIGN: dict[type, tuple[Any, ...]] = {int: (True, False, "3", 2.0), float: (True, False, "3"), bool: (1, 0, "yes")}
OPTIONS = [
    (request, one.name, kind)
    for request in get_args(AnyRequest)
    for one in fields(request)
    for kind in FOREIGN
    if kind in (get_type_hints(request)[one.name], *get_args(get_type_hints(request)[one.name]))
]


@pytest.mark.parametrize(("request_type", "option", "kind"), OPTIONS)
def test_an_option_takes_a_value_of_its_own_type_only(request_type: type, option: str, kind: type) -> None:
    for value in FOREIGN[kind]:
        with pytest.raises(ValidationError) as refused:
            TypeAdapter(request_type).validate_python({option: value})
        assert any(one["loc"] == (option,) and one["type"].startswith(kind.__name__) for one in refused.value.errors())


def test_all_that_are_counted_are_among_them() -> None:
    assert {("nodes", int), ("longest", int), ("rate_hz", float)} <= {
        (name, kind) for request, name, kind in OPTIONS if request is IdentifyRequest
    }


def test_a_whole_number_is_a_number() -> None:
    given = {"kind": "identify", "model_kind": "arx", "runs": ["a"], "rate_hz": 100, "regressors": ["F1"], "nodes": 4}
    assert TypeAdapter(IdentifyRequest).validate_python(given).rate_hz == 100.0
