"""The limits of the machine, of the specimen and of the test together: whichever is tighter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

from excitation.envelope import check
from excitation.errors import EnvelopeError
from excitation.limits_given import TestLimits, limits_of
from excitation.plan import Test
from excitation.rig import Envelope
from rigctl.errors import LimitError
from rigctl.limits import Limits, tighter

__all__ = ["check_envelopes", "limits_together", "within"]


def limits_together(machine: Limits, own: Limits | None, envelopes: Sequence[Envelope], test: Test) -> Limits:
    """The tightest of what the machine declares, the host allows, each envelope allows, and the test is given."""
    limits = machine if own is None else tighter(machine, own)
    for given in (*map(limits_of, envelopes), *(() if test.limits is None else (test.limits,))):
        limits = within(limits, given)
    return limits


def within(limits: Limits, given: TestLimits) -> Limits:
    """Limits made tighter by those that are given; a given limit that is wider changes nothing."""
    stroke = given.max_displacement_m
    asked = {
        "position_min_m": None if stroke is None else -stroke,
        "position_max_m": stroke,
        "velocity_m_s": given.max_velocity_m_s,
        "acceleration_m_s2": given.max_acceleration_m_s2,
        "force_n": given.max_force_n,
        "current_min_a": given.min_current_a,
        "current_max_a": given.max_current_a,
        "temperature_max_degc": given.max_temperature_degc,
        "following_error_m": given.max_following_error_m,
    }
    values = {one.name: getattr(limits, one.name) for one in fields(Limits)}
    return tighter(limits, Limits(**values | {name: value for name, value in asked.items() if value is not None}))


def check_envelopes(test: Test, envelopes: Sequence[Envelope]) -> None:
    """Refuse a test that a rig or a specimen cannot do, by what is predicted from its design: LimitError."""
    for envelope in envelopes:
        try:
            check(test, envelope)
        except EnvelopeError as error:
            raise LimitError(f"{envelope.name}: {error}" if envelope.name else str(error)) from error
