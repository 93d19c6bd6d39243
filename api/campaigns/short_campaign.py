"""A campaign as it travels on the line: who it is and its tests, without their configurations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

from api.campaigns.orders import Asked
from api.campaigns.records import Campaign, CampaignState, CampaignTest, TestState

__all__ = ["as_json", "with_progress"]


def as_json(campaign: Campaign) -> dict[str, Any]:
    """The campaign as JSON; of a configuration only its kind. Any: JSON."""
    tests = tuple(replace(test, config={"kind": str(test.config.get("kind", ""))}) for test in campaign.tests)
    return asdict(replace(campaign, tests=tests, warm_up=None, interlocks=(), envelopes=(), setup={}))


def with_progress(found: Mapping[str, Any], state: Mapping[str, Any], asked: Asked) -> Campaign:
    """The campaign that a worker plays, from what it said on its line, with what was asked of it. Any: JSON."""
    tests = tuple(CampaignTest(**{**test, "state": TestState(test["state"])}) for test in found["tests"])
    if (name := state.get("test")) is not None:
        moved = {"state": TestState.RUNNING, "phase": state["phase"], "samples": state["samples"]}
        tests = tuple(replace(test, **moved) if test.name == name else test for test in tests)
    values = {**found, "interlocks": (), "envelopes": (), "state": CampaignState.RUNNING, "asked": asked}
    return Campaign(**{**values, "tests": tests})
