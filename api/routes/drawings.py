"""Tests as curves, before they are scheduled."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter
from pydantic import BaseModel, ConfigDict, JsonValue

from api.campaigns.drawing import draw
from api.campaigns.new_campaign import check_reads_no_file
from api.service import ServiceDep
from excitation import test_from_config

__all__ = ["router"]

router = APIRouter(prefix="/v1/tests", tags=["tests"])


class OneTest(BaseModel):
    """A test as a campaign has it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    test: dict[str, JsonValue]


class DrawnTest(BaseModel):
    """The motion and the current of a test over time, reduced for a chart."""

    model_config = ConfigDict(frozen=True)

    name: str
    duration_s: float
    shown_s: float
    time_s: list[float]
    displacement_m: list[float]
    velocity_m_s: list[float]
    current_a: list[float] | None


@router.post("/draw")
def draw_test(body: OneTest, service: ServiceDep) -> DrawnTest:
    """Draw a test: its beginning, or one period where it is periodic. Nothing is stored."""
    config: dict[str, Any] = dict(body.test)  # Any: JSON, which excitation checks
    check_reads_no_file(config)
    return DrawnTest(**draw(test_from_config(config, service.runs.samples.excitations())))
