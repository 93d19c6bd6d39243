"""The service does what its OpenAPI description says: requests are generated from it (Schemathesis, every check)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from schemathesis import Case
from schemathesis.checks import CHECKS
from schemathesis.specs.openapi.checks import positive_data_acceptance

from api.app import create_app
from api.settings import Settings
from tests.api.serving import serving

# A campaign may exceed an envelope, a cursor may be none of ours: rules that a schema cannot state, answered with 422.
RULES_BEYOND_THE_SCHEMA = {"cursor", "channels", "from", "name", "file", "since", "until", "if-match"}
LEFT_OUT = r"^/v1/(live|keys|session)|^/v1/rigs.*/(stop|make-safe)$"  # streams, ends the session, or speaks to a rig


@pytest.fixture(scope="module")
def described(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The description, and at its address the service. Any: Schemathesis' own schema."""
    app = create_app(Settings(data_dir=tmp_path_factory.mktemp("lab")), with_workers=False)
    with serving(app) as client:
        base = str(client.base_url).rstrip("/")
        yield schemathesis.openapi.from_url(f"{base}/openapi.json").exclude(path_regex=LEFT_OUT)


def test_every_route_keeps_to_its_description(described: Any) -> None:
    tried = 0
    for found in described.get_all_operations():
        operation = found.ok()
        raw = operation.definition.raw
        names = {str(one.get("name")).lower() for one in raw.get("parameters", [])}
        beyond = "requestBody" in raw or bool(names & RULES_BEYOND_THE_SCHEMA)
        _keeps_to_it(operation, [positive_data_acceptance] if beyond else [])
        tried += 1
    assert tried > 30


def _keeps_to_it(operation: Any, left_out: list[Any]) -> None:
    @settings(
        max_examples=3,
        deadline=None,
        derandomize=True,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(case=operation.as_strategy())
    def holds(case: Case) -> None:
        response = case.call(timeout=60)
        case.validate_response(response, checks=CHECKS.get_all(), excluded_checks=left_out)

    holds()
