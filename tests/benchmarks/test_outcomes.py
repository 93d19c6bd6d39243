"""Outcomes of many cases: kept as they come, and a failure ends the run instead of losing what follows."""

from __future__ import annotations

import json
from contextlib import closing
from pathlib import Path

import pytest

from benchmarks.explain.outcomes import collect, executor_for_cases, read


def judge(seed: int, folder: str) -> dict[str, int]:
    if seed == 1:
        raise ValueError("no machine")
    (Path(folder) / f"tried {seed}").touch()
    return {"seed": seed}


def in_a_line(outcome: dict[str, int]) -> str:
    return f"seed {outcome['seed']}"


def test_a_case_that_fails_ends_the_run_and_what_came_before_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "outcomes.jsonl"
    with closing(executor_for_cases(1)) as executor, pytest.raises(ValueError, match="no machine"):
        collect(judge, [(seed, str(tmp_path)) for seed in range(2000)], path, executor, in_a_line)
    assert read(path) == [{"seed": 0}]
    assert len(list(tmp_path.glob("tried *"))) < 1999, "what nobody would keep was not worked out"


def test_a_line_that_an_interruption_cut_short_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "outcomes.jsonl"
    path.write_text(json.dumps({"seed": 0}) + '\n{"seed": ', encoding="utf-8")
    assert read(path) == [{"seed": 0}]
