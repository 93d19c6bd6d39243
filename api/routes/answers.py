"""The answers of the routes: records of the store as JSON, times as ISO 8601 in UTC."""

from __future__ import annotations

from dataclasses import asdict
from datetime import UTC, datetime

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from api.campaigns.estimate import CampaignEstimate
from api.campaigns.orders import Asked
from api.campaigns.records import Campaign, CampaignState, Event, TestState
from api.jobs.kinds import KINDS
from api.jobs.records import Job, JobState
from api.store.runs import RunRecord

__all__ = [
    "MOST_NUMBER",
    "Answer",
    "CampaignAnswer",
    "CampaignList",
    "CampaignSummary",
    "CheckAnswer",
    "Confirmation",
    "ExplanationAnswer",
    "ExplanationList",
    "Health",
    "JobAnswer",
    "JobList",
    "RunAnswer",
    "RunList",
    "answer_run",
    "check_answer",
    "detail",
    "explanation_answer",
    "iso_time",
    "job_answer",
    "summary",
]

MOST_NUMBER = 2**31 - 1  # of a campaign or a job in a list: an integer of PostgreSQL


class Answer(BaseModel):
    model_config = ConfigDict(frozen=True)


class TestAnswer(Answer):
    """One test and its progress."""

    __test__ = False  # the name starts with "Test": pytest must not collect it

    name: str
    kind: str
    held_out: bool
    state: TestState
    phase: str
    text: str
    samples: int
    total_samples: int
    duration_s: float


class CampaignSummary(Answer):
    """One campaign without its configurations."""

    number: int
    id: str
    name: str
    rig: str
    specimen: str
    state: CampaignState
    reason: str
    asked: Asked
    question: str
    created: str
    started: str | None
    ended: str | None
    tests: list[TestAnswer]


class Confirmation(BaseModel):
    """The operator's answer to what a campaign asks."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    answer: str = Field(default="yes", min_length=1, max_length=40)
    question: str | None = None
    """The question that this answers: it is refused where another one is asked by now. None: whichever is asked."""


class EventAnswer(Answer):
    """One event of a campaign."""

    number: int
    at: str
    text: str


class CampaignAnswer(CampaignSummary):
    """One campaign with its configurations and events."""

    configurations: list[dict[str, JsonValue]]
    warm_up: dict[str, JsonValue] | None
    interlocks: list[str]
    envelopes: list[dict[str, JsonValue]]  # as in a RIG.toml
    setup: dict[str, JsonValue]
    events: list[EventAnswer]


class TestCheck(Answer):
    """What one test asks of the rig; null where no envelope has the data to predict it."""

    __test__ = False  # the name starts with "Test": pytest must not collect it

    name: str
    duration_s: float
    dwell_s: float
    displacement_m: float = Field(description="Peak, from mid-stroke.")
    velocity_m_s: float = Field(description="Peak.")
    acceleration_m_s2: float = Field(description="Peak.")
    highest_frequency_hz: float
    lowest_current_a: float | None
    highest_current_a: float | None
    force_n: float | None = Field(description="Peak, of the specimen that an envelope describes.")
    energy_j: float | None = Field(description="Dissipated in the damper.")
    temperature_rise_k: float | None = Field(description="Of the damper, by this test alone.")
    ends_at_degc: float | None = Field(description="Of the damper, after the tests and dwells before.")
    valve_flow_share: float | None = Field(description="1: the servo-valve is saturated.")


class CheckAnswer(Answer):
    """A dry run: the campaign fits every envelope, and this is what it takes. Nothing was stored."""

    tests: list[TestCheck]
    duration_s: float = Field(description="Of motion and dwells, without waiting for an operator or the oil.")
    energy_j: float | None
    highest_degc: float | None = Field(description="Of the damper, predicted.")
    warnings: list[str] = Field(description="Detection lines of a test that another channel excites.")


class CampaignList(Answer):
    """Campaigns, the newest first; ``next_cursor`` is ``cursor``, ``next_before`` ``before`` of the next page."""

    campaigns: list[CampaignSummary]
    next_before: int | None
    next_cursor: str | None = None


class RunAnswer(Answer):
    """One captured run; ``file`` is where it can be downloaded."""

    id: str
    test: str
    held_out: bool
    status: str
    samples: int
    sample_rate_hz: float
    created: str
    size_bytes: int
    sha256: str
    file: str
    loops: str


class RunList(Answer):
    """The runs of one campaign in the order of its tests."""

    runs: list[RunAnswer]


class EffectAnswer(Answer):
    """One named effect of a report."""

    element: str
    confidence: float


class ExplanationAnswer(Answer):
    """One explanation: its progress, its result and where its files are."""

    number: int
    id: str
    name: str
    campaign: str | None
    runs: list[str]
    held_out: list[str]
    state: JobState
    phase: str
    done: float
    reason: str
    verdict: str | None
    effects: list[EffectAnswer]
    created: str
    started: str | None
    ended: str | None
    report: str | None
    report_html: str | None
    model: str | None
    evidence: str | None


class ExplanationList(Answer):
    """Explanations, the newest first; ``next_cursor`` is ``cursor``, ``next_before`` ``before`` of the next page."""

    explanations: list[ExplanationAnswer]
    next_before: int | None
    next_cursor: str | None = None


class JobAnswer(Answer):
    """One job: its progress, its result and where its files are."""

    number: int
    id: str
    kind: str
    name: str
    campaign: str | None
    runs: list[str]
    held_out: list[str]
    state: JobState
    phase: str
    done: float
    reason: str
    result: dict[str, JsonValue]
    created: str
    started: str | None
    ended: str | None
    files: dict[str, str]


class JobList(Answer):
    """Jobs, the newest first; ``next_cursor`` is ``cursor``, ``next_before`` ``before`` of the next page."""

    jobs: list[JobAnswer]
    next_before: int | None
    next_cursor: str | None = None


class Health(Answer):
    """Whether the store answers."""

    status: str
    version: str


def summary(campaign: Campaign) -> CampaignSummary:
    return CampaignSummary(
        number=campaign.number,
        id=campaign.id,
        name=campaign.name,
        rig=campaign.rig,
        specimen=campaign.specimen,
        state=campaign.state,
        reason=campaign.reason,
        asked=campaign.asked,
        question=campaign.question,
        created=iso_time(campaign.created_at_s),
        started=_when(campaign.started_at_s),
        ended=_when(campaign.ended_at_s),
        tests=[
            TestAnswer(
                name=test.name,
                kind=str(test.config.get("kind", "")),
                held_out=test.held_out,
                state=test.state,
                phase=test.phase,
                text=test.text,
                samples=test.samples,
                total_samples=test.total_samples,
                duration_s=test.duration_s,
            )
            for test in campaign.tests
        ],
    )


def detail(campaign: Campaign, events: tuple[Event, ...]) -> CampaignAnswer:
    return CampaignAnswer(
        **dict(summary(campaign)),
        configurations=[dict(test.config) for test in campaign.tests],
        warm_up=None if campaign.warm_up is None else dict(campaign.warm_up),
        interlocks=list(campaign.interlocks),
        envelopes=[dict(one) for one in campaign.envelopes],
        setup=dict(campaign.setup),
        events=[EventAnswer(number=e.number, at=iso_time(e.at_s), text=e.text) for e in events],
    )


def check_answer(found: CampaignEstimate) -> CheckAnswer:
    return CheckAnswer(
        tests=[
            TestCheck(
                name=test.name,
                dwell_s=test.dwell_s,
                ends_at_degc=test.ends_at_degc,
                **{name: value for name, value in asdict(test.prediction).items() if name in TestCheck.model_fields},
            )
            for test in found.tests
        ],
        duration_s=found.duration_s,
        energy_j=found.energy_j,
        highest_degc=found.highest_degc,
        warnings=list(found.warnings),
    )


def answer_run(run: RunRecord) -> RunAnswer:
    here = f"/v1/campaigns/{run.campaign_id}/runs/{run.id}"
    return RunAnswer(
        id=run.id,
        test=run.test,
        held_out=run.held_out,
        status=run.status,
        samples=run.samples,
        sample_rate_hz=run.sample_rate_hz,
        created=run.created,
        size_bytes=run.size_bytes,
        sha256=run.sha256,
        file=here,
        loops=f"{here}/loops",
    )


def job_answer(job: Job) -> JobAnswer:
    here = f"/v1/jobs/{job.id}"
    kind = KINDS.get(job.kind)
    return JobAnswer(
        number=job.number,
        id=job.id,
        kind=job.kind,
        name=job.name,
        campaign=job.campaign_id or None,
        runs=list(job.runs),
        held_out=list(job.held_out),
        state=job.state,
        phase=job.phase,
        done=job.done,
        reason=job.reason,
        result=dict(job.result),
        created=iso_time(job.created_at_s),
        started=_when(job.started_at_s),
        ended=_when(job.ended_at_s),
        files={name: f"{here}/files/{name}" for name in kind.files_of(job.request)} if kind and job.has_files else {},
    )


def explanation_answer(job: Job) -> ExplanationAnswer:
    here = f"/v1/explanations/{job.id}"
    same = set(ExplanationAnswer.model_fields) & set(JobAnswer.model_fields)
    effects = job.result.get("effects", [])
    return ExplanationAnswer(
        **{name: value for name, value in job_answer(job) if name in same},
        verdict=job.result.get("verdict"),
        effects=[EffectAnswer(element=name, confidence=confidence) for name, confidence in effects],
        report=f"{here}/report.json" if job.has_files else None,
        report_html=f"{here}/report.html" if job.has_files else None,
        model=f"{here}/model.json" if job.has_files else None,
        evidence=f"{here}/evidence.h5" if job.has_files else None,
    )


def _when(seconds: float | None) -> str | None:
    return None if seconds is None else iso_time(seconds)


def iso_time(seconds: float) -> str:
    """A time of the store, seconds since 1970, as ISO 8601 in UTC."""
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds")
