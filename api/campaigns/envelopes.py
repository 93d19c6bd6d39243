"""The envelopes that hold for a campaign: those that the service was started with, and its own."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from api.campaigns.new_campaign import note_excesses
from api.campaigns.records import Campaign
from api.findings import Findings
from api.settings import Settings
from excitation import TestPlan
from excitation.configuration import to_spec
from excitation.rig import Envelope, read_envelope

__all__ = ["check_campaign", "envelopes_of", "service_envelopes"]


def service_envelopes(settings: Settings) -> tuple[Envelope, ...]:
    """The envelopes of every campaign of a service; raises DesignError, one line, for a file that cannot be used."""
    return tuple(read_envelope(Path(name)) for name in settings.envelopes.split(os.pathsep) if name)


def envelopes_of(campaign: Campaign, service: Sequence[Envelope]) -> tuple[Envelope, ...]:
    """The service's envelopes and those of a campaign."""
    return (*service, *(to_spec(Envelope, one, "envelopes") for one in campaign.envelopes))


def check_campaign(plan: TestPlan, service: Sequence[Envelope]) -> None:
    """Raise Refused, which lists every test that exceeds an envelope of the service."""
    found = Findings()
    for envelope in service:
        note_excesses(plan, envelope, found)
    found.refuse()
