"""What watchers are told: the lists as they are, and what has changed from one reading to the next. Pure."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

__all__ = ["Reading", "event", "lists", "news"]

Summary = Mapping[str, Any]  # a CampaignSummary as JSON

_MOVING = ("phase", "samples", "text")  # of a test that runs: they change with every reading


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """One reading of the store. Any: JSON, as the routes answer it."""

    campaigns: Sequence[Summary] = ()
    explanations: Sequence[Mapping[str, Any]] = ()
    queues: Mapping[str, Any] | None = None  # by the ids of the rigs


def event(name: str, data: object) -> str:
    """One server-sent event. ``data`` is any JSON."""
    return f"event: {name}\ndata: {json.dumps(data, separators=(',', ':'))}\n\n"


def lists(reading: Reading) -> list[str]:
    """The events that say everything."""
    return [_campaigns(reading), _explanations(reading), _queues(reading)]


def news(before: Reading | None, now: Reading) -> list[str]:
    """The events that lead from one reading to the next.

    Of a campaign whose tests only advance, its progress alone is told: a plan has up to 500 tests, and 200 watchers.
    """
    if before is None:
        return lists(now)
    said = [] if now.explanations == before.explanations else [_explanations(now)]
    said += [] if now.queues == before.queues else [_queues(now)]
    known = {one["id"]: one for one in before.campaigns}
    if [one["id"] for one in now.campaigns] != list(known):
        return [_campaigns(now), *said]
    progress: list[dict[str, Any]] = []
    for one in now.campaigns:
        if one == known[one["id"]]:
            continue
        if _outline(one) != _outline(known[one["id"]]):
            said.append(event("campaign", one))
        else:
            progress += _progress(known[one["id"]], one)
    return [*said, event("progress", progress)] if progress else said


def _campaigns(reading: Reading) -> str:
    return event("campaigns", {"campaigns": list(reading.campaigns), "next_before": None})


def _explanations(reading: Reading) -> str:
    return event("explanations", {"explanations": list(reading.explanations), "next_before": None})


def _queues(reading: Reading) -> str:
    return event("queues", {"queues": dict(reading.queues or {})})


def _outline(one: Summary) -> dict[str, Any]:
    """A campaign without what moves while a test runs."""
    tests = [{key: value for key, value in test.items() if key not in _MOVING} for test in one["tests"]]
    return {**one, "tests": tests}


def _progress(before: Summary, now: Summary) -> list[dict[str, Any]]:
    return [
        {"campaign": now["id"], "position": place, **{key: test[key] for key in _MOVING}}
        for place, (test, old) in enumerate(zip(now["tests"], before["tests"], strict=True))
        if test != old
    ]
