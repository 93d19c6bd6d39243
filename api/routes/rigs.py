"""Rigs: their workers and their waiting campaigns."""

from __future__ import annotations

from fastapi import APIRouter

from api.routes.answers import RigList, rig_answer
from api.service import ServiceDep

__all__ = ["router"]

router = APIRouter(prefix="/v1/rigs", tags=["rigs"])


@router.get("")
def list_rigs(service: ServiceDep) -> RigList:
    """Every rig that a campaign names."""
    return RigList(rigs=[rig_answer(rig) for rig in service.campaigns.rigs()])
