"""Explain, run the most informative test, explain again, until every name is sure or the rig time is used up."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from excitation.plan import Test, test_from_config
from identification.discrepancy import Explanation, Verdict
from rigctl.runfile import Run

__all__ = ["SURE", "Round", "autopilot", "settled", "sure"]

SURE = 0.85  # no further test when every name has this confidence


@dataclass(frozen=True, slots=True)
class Round:
    """One explanation: of how many runs, after how much rig time, and the reason if it was the last."""

    found: Explanation
    runs: int
    rig_seconds: float
    ended: str  # the reason of the end; "" if a further test follows


def autopilot(
    runs: Sequence[Run],
    *,
    explain: Callable[[Sequence[Run]], Explanation],
    play: Callable[[Test], Run],
    budget_s: float,
    on_round: Callable[[Round], None] = lambda made: None,
) -> list[Round]:
    """The rounds of explaining and testing; the last one states why it was the last.

    `explain` explains the runs so far; `play` runs one test on the rig and returns its run. No test starts that would
    exceed `budget_s` seconds of motion. Errors of both are passed on; `on_round` was called for each round before.
    """
    measured, spent = list(runs), 0.0
    rounds: list[Round] = []
    while True:
        found = explain(measured)
        test = _next(found, len(rounds) + 1)
        ended = _end_reason(found, rounds[-1].found if rounds else None, test, budget_s - spent)
        rounds.append(Round(found, len(measured), spent, ended))
        on_round(rounds[-1])
        if ended or test is None:
            return rounds
        measured.append(play(test))
        spent += _seconds(test)


def sure(found: Explanation) -> bool:
    """Whether the gap is explained and every name is sure."""
    return found.verdict == Verdict.EXPLAINED and _sure_names(found)


def settled(found: Explanation, before: Explanation | None) -> bool:
    """Whether the names are sure, and either explain the gap or did not change with one more test."""
    same = before is not None and _sure_names(before) and _names(found) == _names(before)
    return sure(found) or (same and _sure_names(found))


def _sure_names(found: Explanation) -> bool:
    return bool(found.effects) and all(e.confidence >= SURE for e in found.effects)


def _names(found: Explanation) -> set[str]:
    return {e.element for e in found.effects}


def _next(found: Explanation, number: int) -> Test | None:
    design = dict(found.next_test.design)
    return replace(test_from_config(design), name=f"next {number}") if design else None


def _seconds(test: Test) -> float:
    return test.excitation.samples / test.excitation.sample_rate_hz


def _end_reason(found: Explanation, before: Explanation | None, test: Test | None, left_s: float) -> str:
    if found.verdict == Verdict.NO_DISCREPANCY and test is None:
        return "the model meets the data"
    if sure(found):
        return "every name is sure"
    if settled(found, before):
        return "every name is sure; the remaining gap has no name"
    if test is None:
        return "no further test within the motion so far would be informative"
    if _seconds(test) > left_s:
        return f"the next test takes {_seconds(test):.0f} s, {max(left_s, 0.0):.0f} s of rig time are left"
    return ""
