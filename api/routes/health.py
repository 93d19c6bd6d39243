"""Health: whether the store answers."""

from __future__ import annotations

from importlib.metadata import version

from fastapi import APIRouter

from api.routes.answers import Health
from api.service import ServiceDep

__all__ = ["router"]

router = APIRouter(tags=["health"])


@router.get("/healthz")
def health(service: ServiceDep) -> Health:
    """200 where the campaign store answers, 503 where it does not."""
    service.database.ping()
    return Health(status="ok", version=version("damper-rig"))
