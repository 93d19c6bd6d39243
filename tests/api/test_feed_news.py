"""What watchers are told when something changes: that, and no more."""

from __future__ import annotations

import copy
import json
from typing import Any

from api.routes.feed_news import Reading, lists, news


def campaign(number: int) -> dict[str, Any]:
    tests = [{"name": f"test {k}", "state": "waiting", "phase": "", "samples": 0, "text": ""} for k in range(500)]
    return {"id": f"c{number}", "number": number, "state": "running", "tests": tests}


def told(before: Reading | None, now: Reading) -> dict[str, Any]:
    found = (text.strip().split("\ndata: ") for text in news(before, now))
    return {head.removeprefix("event: "): json.loads(data) for head, data in found}


def after(before: Reading, **changes: Any) -> Reading:
    one = copy.deepcopy(dict(before.campaigns[0]))
    one["tests"][0] |= {key: value for key, value in changes.items() if key != "campaign_state"}
    one["state"] = changes.get("campaign_state", one["state"])
    return Reading(campaigns=[one, *before.campaigns[1:]], explanations=before.explanations, queues=before.queues)


BEFORE = Reading(campaigns=[campaign(2), campaign(1)], queues={"r": {"campaigns": ["c1"], "version": "v"}})


def test_the_first_reading_is_told_whole() -> None:
    assert news(None, BEFORE) == lists(BEFORE)
    assert set(told(None, BEFORE)) == {"campaigns", "explanations", "queues"}


def test_nothing_is_told_where_nothing_changed() -> None:
    assert news(BEFORE, copy.deepcopy(BEFORE)) == []


def test_of_a_test_that_advances_its_progress_alone_is_told() -> None:
    now = after(BEFORE, samples=70, phase="running")
    assert told(BEFORE, now) == {
        "progress": [{"campaign": "c2", "position": 0, "phase": "running", "samples": 70, "text": ""}]
    }
    assert len(news(BEFORE, now)[0]) < 200  # of a campaign of 500 tests


def test_a_campaign_that_changes_its_state_is_told_whole_and_alone() -> None:
    now = after(BEFORE, campaign_state="done", state="done", samples=100)
    assert told(BEFORE, now) == {"campaign": now.campaigns[0]}


def test_a_campaign_that_comes_or_goes_is_told_with_the_list() -> None:
    now = Reading(campaigns=[campaign(3), *BEFORE.campaigns], queues={})
    assert set(told(BEFORE, now)) == {"campaigns", "queues"}
    assert [one["id"] for one in told(BEFORE, now)["campaigns"]["campaigns"]] == ["c3", "c2", "c1"]
