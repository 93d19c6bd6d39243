"""Health: whether the service runs, and whether it can do its work."""

from __future__ import annotations

from importlib.metadata import version

from fastapi import APIRouter

from api.routes.answers import Health
from api.service import ServiceDep

__all__ = ["router"]

router = APIRouter(tags=["health"])


@router.get("/v1/health/live")
async def live() -> Health:
    """200 as long as the process answers: restart it where it does not. Uses no store and no thread."""
    return Health(status="ok", version=version("damper-rig"))


@router.get("/v1/health/ready")
def ready(service: ServiceDep) -> Health:
    """200 where the store answers, 503 where not: send no requests here meanwhile."""
    service.database.ping()
    return Health(status="ok", version=version("damper-rig"))


@router.get("/healthz")
def health(service: ServiceDep) -> Health:
    """As ready."""
    return ready(service)
