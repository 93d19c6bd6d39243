"""The page on safety names code and tests that exist."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "safety.md").read_text(encoding="utf-8")


def test_every_file_that_the_page_on_safety_names_exists() -> None:
    named = set(re.findall(r"`((?:\w+/)+\w+\.py)`", PAGE)) | {
        f"docs/{name}" for name in re.findall(r"\]\((\w+\.md)\)", PAGE)
    }
    assert len(named) > 25
    assert sorted(name for name in named if not (ROOT / name).is_file()) == []


def test_every_hazard_has_code_and_a_test() -> None:
    rows = [line for line in PAGE.splitlines() if line.startswith("|") and ".py`" in line]
    assert len(rows) >= 14
    for row in rows:
        _, hazard, done, where, test, _ = (cell.strip() for cell in row.split("|"))
        assert hazard
        assert done
        assert ".py`" in where
        assert "tests/" not in where
        assert re.fullmatch(r"`tests/\S+`(, `tests/\S+`)*", test), row
