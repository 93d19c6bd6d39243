"""The table of routes in docs/service.md is the one that the app itself gives."""

from __future__ import annotations

from pathlib import Path

from api.access.rules import RULES
from api.app import create_app
from api.settings import Settings

GUIDE = Path(__file__).parents[2] / "docs" / "service.md"


def documented(folder: Path) -> str:
    """Every route of the OpenAPI description by its path: who may use it, and the first line of what it says."""
    paths = create_app(Settings(data_dir=folder), with_workers=False).openapi()["paths"]
    rows = ["| route | scope | what it does |", "|---|---|---|"]
    for path in sorted(paths):
        for method, route in sorted(paths[path].items()):
            rule = RULES[method.upper(), path]
            line = route["description"].splitlines()[0].replace("``", "`").replace("|", "\\|")
            rows.append(f"| `{method.upper()} {path}` | {rule.scope or 'none'} | {line} |")
    return "\n".join(rows)


def test_the_documented_routes_are_those_of_the_app(tmp_path: Path) -> None:
    table = documented(tmp_path)
    assert f"\n{table}\n\n" in GUIDE.read_text(encoding="utf-8"), f"docs/service.md needs:\n{table}"
