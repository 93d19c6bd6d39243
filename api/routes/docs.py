"""A page of every route, made from the OpenAPI description; it needs no network."""

from __future__ import annotations

from html import escape
from typing import Any

from fastapi import APIRouter, Request
from fastapi.responses import HTMLResponse, JSONResponse

from api.problems import kinds

__all__ = ["router"]

router = APIRouter(include_in_schema=False)

_STYLE = """
:root { color-scheme: light dark; --ink: #17212b; --soft: #51606d; --paper: #fff; --code: #f2f5f7; --link: #0a5c9a; }
@media screen and (prefers-color-scheme: dark) {
  :root { --ink: #e4eaef; --soft: #a5b3bf; --paper: #18212a; --code: #0f161c; --link: #6fb6ee; }
}
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 60rem;
  margin: 2rem auto; padding: 0 1rem; overflow-wrap: anywhere; }
a { color: var(--link); }
h2 { font-size: 1.05rem; margin: 1.6rem 0 .2rem; font-family: ui-monospace, monospace; }
p { margin: .2rem 0; } .hint { color: var(--soft); font-size: .9rem; }
pre { background: var(--code); padding: .8rem; overflow: auto; }
"""
_EXAMPLE = """curl -X POST http://127.0.0.1:8420/v1/campaigns -H 'content-type: application/json' -d '{
  "name": "first look", "rig": "modbus://127.0.0.1:5020", "specimen": "damper 7",
  "tests": [{"name": "sine", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01,
             "frequency": 2.0, "cycles": 10, "current": 0.5, "held_out": false}]
}'"""


@router.get("/openapi.json")
def openapi(request: Request) -> JSONResponse:
    return JSONResponse(request.app.openapi())


@router.get("/docs")
def docs(request: Request) -> HTMLResponse:
    schema = request.app.openapi()
    types = schema["components"]["schemas"]
    routes = "".join(
        _route(method, path, route, types)
        for path, methods in schema["paths"].items()
        for method, route in methods.items()
    )
    return HTMLResponse(
        f'<!doctype html><html lang="en"><head><meta charset="utf-8">'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><title>damper-rig: HTTP interface</title>'
        f'<link rel="icon" href="data:,"><style>{_STYLE}</style></head><body><h1>HTTP interface</h1>'
        f"<p>Version {escape(schema['info']['version'])}. Bad requests are answered with 4xx and one line in "
        f'<code>detail</code> of a problem (RFC 9457). <a href="/openapi.json">OpenAPI</a> for programs.</p>'
        f"<pre>{escape(_EXAMPLE)}</pre>{routes}<h1>Problems</h1>{_problems()}</body></html>"
    )


def _problems() -> str:
    """What the ``type`` of a problem refers to."""
    return "".join(
        f'<h2 id="{name}">{name}</h2><p>{status}: {escape(title)}.</p>' for status, (name, title) in kinds().items()
    )


def _route(method: str, path: str, route: dict[str, Any], types: dict[str, Any]) -> str:
    # Any, here and below: OpenAPI's own JSON
    query = ", ".join(item["name"] for item in route.get("parameters", []) if item["in"] == "query")
    content = route.get("requestBody", {}).get("content", {}).get("application/json", {})
    hints = [f"Query: {query}"] if query else []
    hints += [f"Body: {body}" for body in _bodies(content.get("schema", {}), types)]
    more = "".join(f'<p class="hint">{escape(hint)}</p>' for hint in hints)
    text = escape(route.get("description", route.get("summary", "")))
    return f"<h2>{method.upper()} {escape(path)}</h2><p>{text}</p>{more}"


def _bodies(schema: dict[str, Any], types: dict[str, Any]) -> list[str]:
    """The keys of a body with their types, one line for each kind of body."""
    refs = schema.get("oneOf", [schema] if "$ref" in schema else [])
    found = [types[ref["$ref"].rsplit("/", 1)[1]] for ref in refs]
    return ["; ".join(f"{key}: {_type(value)}" for key, value in one["properties"].items()) for one in found]


def _type(value: dict[str, Any]) -> str:
    if "const" in value:
        return str(value["const"])
    if "anyOf" in value:
        return " or ".join(map(_type, value["anyOf"]))
    if value.get("type") == "array":
        return f"array of {_type(value['items'])}"
    return str(value.get("type", "any"))
