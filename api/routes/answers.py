"""The answers of the routes: records of the store as JSON, times as ISO 8601 in UTC."""

from __future__ import annotations

from datetime import UTC, datetime

from pydantic import BaseModel, ConfigDict, JsonValue

from api.campaigns.orders import Asked
from api.campaigns.records import Campaign, CampaignState, Event, RigRecord, TestState
from api.jobs.kinds import KINDS
from api.jobs.records import Job, JobState
from api.store.runs import RunRecord, Upload

__all__ = [
    "MOST_NUMBER",
    "CampaignAnswer",
    "CampaignList",
    "CampaignSummary",
    "ExplanationAnswer",
    "ExplanationList",
    "Health",
    "JobAnswer",
    "JobList",
    "RigList",
    "RunAnswer",
    "RunList",
    "UploadAnswer",
    "answer_run",
    "detail",
    "explanation_answer",
    "job_answer",
    "rig_answer",
    "summary",
    "upload_answer",
]

MOST_NUMBER = 2**31 - 1  # of a campaign or a job in a list: an integer of PostgreSQL


class _Answer(BaseModel):
    model_config = ConfigDict(frozen=True)


class TestAnswer(_Answer):
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


class CampaignSummary(_Answer):
    """One campaign without its configurations."""

    number: int
    id: str
    name: str
    rig: str
    specimen: str
    state: CampaignState
    reason: str
    asked: Asked
    created: str
    started: str | None
    ended: str | None
    tests: list[TestAnswer]


class EventAnswer(_Answer):
    """One event of a campaign."""

    number: int
    at: str
    text: str


class CampaignAnswer(CampaignSummary):
    """One campaign with its configurations and events."""

    configurations: list[dict[str, JsonValue]]
    warm_up: dict[str, JsonValue] | None
    interlocks: list[str]
    events: list[EventAnswer]


class CampaignList(_Answer):
    """Campaigns, the newest first; ``next_before`` is ``before`` of the next page."""

    campaigns: list[CampaignSummary]
    next_before: int | None


class RunAnswer(_Answer):
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


class RunList(_Answer):
    """The runs of one campaign in the order of capture."""

    runs: list[RunAnswer]


class RigAnswer(_Answer):
    """One rig: its worker, its running campaign, and how many campaigns wait."""

    url: str
    worker: str | None
    running: str | None
    accepted: int


class RigList(_Answer):
    """Every rig that a campaign names."""

    rigs: list[RigAnswer]


class UploadAnswer(_Answer):
    """An uploaded run file."""

    id: str
    name: str
    specimen: str
    status: str
    samples: int
    sample_rate_hz: float
    size_bytes: int
    sha256: str


class EffectAnswer(_Answer):
    """One named effect of a report."""

    element: str
    confidence: float


class ExplanationAnswer(_Answer):
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


class ExplanationList(_Answer):
    """Explanations, the newest first; ``next_before`` is ``before`` of the next page."""

    explanations: list[ExplanationAnswer]
    next_before: int | None


class JobAnswer(_Answer):
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


class JobList(_Answer):
    """Jobs, the newest first; ``next_before`` is ``before`` of the next page."""

    jobs: list[JobAnswer]
    next_before: int | None


class Health(_Answer):
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
        created=_time(campaign.created_at_s),
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
        events=[EventAnswer(number=e.number, at=_time(e.at_s), text=e.text) for e in events],
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


def rig_answer(rig: RigRecord) -> RigAnswer:
    return RigAnswer(url=rig.url, worker=rig.worker or None, running=rig.running or None, accepted=rig.accepted)


def upload_answer(upload: Upload) -> UploadAnswer:
    return UploadAnswer(**{name: getattr(upload, name) for name in UploadAnswer.model_fields})


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
        created=_time(job.created_at_s),
        started=_when(job.started_at_s),
        ended=_when(job.ended_at_s),
        files={name: f"{here}/files/{name}" for name in kind.files} if kind and job.has_files else {},
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
    return None if seconds is None else _time(seconds)


def _time(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec="milliseconds")
