"""What a campaign will take and ask of its rig: the answer of a dry run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan

from excitation import Envelope, TestPlan
from excitation.envelope import temperatures
from excitation.prediction import Prediction, predict
from excitation.rig import MotionLimits

__all__ = ["CampaignEstimate", "TestEstimate", "estimate"]

_ANY = Envelope(motion=MotionLimits(max_displacement_m=1e3, max_velocity_m_s=1e3))  # beyond every rig: only predicts


@dataclass(frozen=True, slots=True, kw_only=True)
class TestEstimate:
    """One test: its duration and its peaks; None where no envelope has the data to predict it."""

    __test__ = False  # the name starts with "Test": pytest must not collect it

    name: str
    prediction: Prediction
    dwell_s: float
    ends_at_degc: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignEstimate:
    """A campaign that fits: its tests in order. ``duration_s`` is motion and dwells, without waiting for operators."""

    tests: tuple[TestEstimate, ...]
    duration_s: float
    energy_j: float | None  # dissipated in the damper
    highest_degc: float | None  # predicted, of the damper
    warnings: tuple[str, ...]  # detection lines that another channel excites


def estimate(plan: TestPlan, envelopes: Sequence[Envelope]) -> CampaignEstimate:
    """The estimate of a plan; force and heat are those of the first envelope that describes the specimen."""
    from excitation.analysis import spoiled_in  # with scipy 0.2 s to import: not at the start of the service

    envelope = next((one for one in envelopes if one.specimen is not None), envelopes[0] if envelopes else _ANY)
    predictions = tuple(predict(test.excitation, envelope) for test in plan.tests)
    degc = [None if isnan(one) else one for one in temperatures(plan, predictions, envelope)]
    energies = [one.energy_j for one in predictions if one.energy_j is not None]
    return CampaignEstimate(
        tests=tuple(
            TestEstimate(name=test.name, prediction=one, dwell_s=test.dwell_s, ends_at_degc=ends)
            for test, one, ends in zip(plan.tests, predictions, degc, strict=True)
        ),
        duration_s=plan.duration_s,
        energy_j=sum(energies) if len(energies) == len(predictions) else None,
        highest_degc=max((one for one in degc if one is not None), default=None),
        warnings=spoiled_in(plan),
    )
