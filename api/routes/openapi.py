"""The OpenAPI description: that of FastAPI, with what it cannot know."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi

from api.campaigns.typed_tests import units
from api.problems import Problem
from api.routes.examples import REQUESTS

__all__ = ["describe"]

_REFS = "#/components/schemas/{model}"


def describe(app: FastAPI) -> dict[str, Any]:
    """The description, made once. Any: OpenAPI's own JSON."""
    if app.openapi_schema is None:
        made = get_openapi(title=app.title, version=app.version, routes=app.routes)
        problem = Problem.model_json_schema(ref_template=_REFS, mode="serialization")
        schemas = made["components"]["schemas"]
        schemas.update(problem.pop("$defs"))
        schemas["Problem"] = problem
        for name, keys in units().items():
            properties = schemas.get(name, {}).get("properties", {})
            for key, unit in keys.items():
                properties.get(key, {})["description"] = f"Unit: {unit}."
        for name, examples in REQUESTS.items():
            schemas[name]["examples"] = examples
        app.openapi_schema = made
    return app.openapi_schema
