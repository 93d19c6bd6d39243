"""Runs: all of them by what they are, their samples, their removal; specimens."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Annotated, Literal

from fastapi import APIRouter, Query, Request, Response
from fastapi.responses import FileResponse
from pydantic import BeforeValidator

from api.campaigns.samples import Samples, samples_of, to_csv
from api.findings import Finding, Refused
from api.routes.answers import Answer, iso_time
from api.routes.files import run_file
from api.routes.paging import CursorDep, Limit, cursor_of, link_pages, read_cursor
from api.service import ServiceDep
from api.store.run_catalogue import AnyRun, RunFilter
from rigctl.runfile import read_run

__all__ = ["RunRecordAnswer", "record_answer", "router"]

router = APIRouter(prefix="/v1", tags=["runs"])

_LATEST_S = 253_402_300_799.0  # the last second of the year 9999


class RunRecordAnswer(Answer):
    """One run, captured in a campaign or uploaded; `removed`: when its file was removed."""

    id: str
    name: str
    campaign: str | None
    rig: str | None
    specimen: str
    test: str
    status: str
    held_out: bool
    samples: int
    sample_rate_hz: float
    size_bytes: int
    sha256: str
    created: str
    removed: str | None
    file: str
    data: str


class RunRecordList(Answer):
    """Runs, the newest first; ``next_cursor`` is ``cursor`` of the next page."""

    runs: list[RunRecordAnswer]
    next_cursor: str | None


class ChannelSamples(Answer):
    """One channel; ``lowest`` and ``highest`` of each step are the samples themselves where a step is one sample."""

    unit: str
    lowest: list[float]
    highest: list[float]


class RunData(Answer):
    """Samples of a run in steps of ``step`` samples."""

    id: str
    start: int
    end: int
    step: int
    sample_rate_hz: float
    time_s: list[float]
    channels: dict[str, ChannelSamples]


class SpecimenAnswer(Answer):
    """A specimen and how many runs of it there are."""

    name: str
    runs: int
    size_bytes: int


class SpecimenList(Answer):
    """Specimens by name."""

    specimens: list[SpecimenAnswer]


Text = Annotated[str, Query(max_length=500)]


def _no_number(value: object) -> object:
    """A time as text: pydantic would read a number as seconds or milliseconds, by its size."""
    if isinstance(value, str) and not value[4:5] == "-":
        raise ValueError("it must be a date or time of ISO 8601, such as 2026-11-23T05:00:00Z")
    return value


Time = Annotated[
    datetime | None, BeforeValidator(_no_number), Query(description="ISO 8601; without an offset it is UTC.")
]


@router.get("/runs")
def list_runs(
    service: ServiceDep,
    request: Request,
    response: Response,
    limit: Limit = 50,
    cursor: CursorDep = "",
    rig: Text = "",
    specimen: Text = "",
    test: Text = "",
    status: Literal["", "complete", "aborted", "truncated"] = "",
    since: Time = None,
    until: Time = None,
    removed: Annotated[bool, Query(description="Also those whose file was removed.")] = False,
) -> RunRecordList:
    """Captured and uploaded runs, the newest first."""
    chosen = RunFilter(
        rig=rig,
        specimen=specimen,
        test=test,
        status=status,
        since_s=_seconds(since, "since"),
        until_s=_seconds(until, "until"),
        removed=removed,
    )
    found = service.catalogue.newest(chosen, limit=limit, after=_after(cursor))
    following = cursor_of(*found[-1].key) if len(found) == limit else None
    link_pages(request, response, following)
    return RunRecordList(runs=[record_answer(run) for run in found], next_cursor=following)


@router.get("/runs/{run_id}")
def one(run_id: str, service: ServiceDep) -> RunRecordAnswer:
    """The record of a run, also of one whose file was removed."""
    return record_answer(service.catalogue.one(run_id))


@router.get("/runs/{run_id}/file", response_class=FileResponse)
def file(run_id: str, service: ServiceDep) -> FileResponse:
    """The run file; ranges of it by the Range header."""
    run = service.catalogue.present(run_id)
    return run_file(service.runs.paths([run.id])[0], run.sha256)


@router.get(
    "/runs/{run_id}/data",
    response_model=RunData,
    responses={200: {"content": {"text/csv": {"schema": {"type": "string"}}}}},
)
def data(
    run_id: str,
    service: ServiceDep,
    channels: Annotated[str, Query(max_length=1000, description="Names, with commas; default: all.")] = "",
    start: Annotated[int, Query(alias="from", ge=0, le=2**40, description="First sample.")] = 0,
    end: Annotated[int | None, Query(alias="to", ge=1, le=2**40, description="One behind the last sample.")] = None,
    points: Annotated[int, Query(ge=1, le=100_000, description="Most steps of the answer.")] = 2000,
    form: Annotated[Literal["json", "csv"], Query(alias="format")] = "json",
) -> Response:
    """Samples of a run: whole, or the lowest and highest value of each step, so that no peak is lost."""
    record = service.catalogue.present(run_id)
    run = read_run(service.runs.paths([record.id])[0])
    names = [name for part in channels.split(",") if (name := part.strip())]
    samples = samples_of(run, names, start, end, points)
    if form == "csv":
        return Response(to_csv(samples), media_type="text/csv")
    return Response(_data(record, samples).model_dump_json(), media_type="application/json")


@router.delete("/runs/{run_id}", status_code=204)
def remove(run_id: str, service: ServiceDep) -> None:
    """Remove the file of a run; its record stays. Refused while a job uses the run."""
    record = service.catalogue.remove(run_id)
    service.runs.remove_file(record.location)


@router.get("/specimens", tags=["specimens"])
def list_specimens(service: ServiceDep) -> SpecimenList:
    """Every specimen of which there are runs; `GET /v1/runs?specimen=…` lists these."""
    return SpecimenList(
        specimens=[
            SpecimenAnswer(name=one.name, runs=one.runs, size_bytes=one.size_bytes)
            for one in service.catalogue.specimens()
        ]
    )


def _after(cursor: str) -> tuple[float, str] | None:
    if not cursor:
        return None
    match read_cursor(cursor):
        case (int() | float() as at, str() as run_id) if 0 <= at <= _LATEST_S and run_id.isprintable():
            return float(at), run_id
    raise Refused([Finding(detail="cursor is not one of this list", pointer="/cursor", source="query")])


def _seconds(time: datetime | None, name: str) -> float | None:
    if time is None:
        return None
    seconds = (time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp()
    if not 0 <= seconds <= _LATEST_S:
        raise Refused([Finding(detail=f"{name} must lie in the years 1970 … 9999", pointer=f"/{name}", source="query")])
    return seconds


def record_answer(run: AnyRun) -> RunRecordAnswer:
    """The record of a run as an answer."""
    here = f"/v1/runs/{run.id}"
    return RunRecordAnswer(
        id=run.id,
        name=run.location.rpartition("/")[2],
        campaign=run.campaign_id or None,
        rig=run.rig or None,
        specimen=run.specimen,
        test=run.test,
        status=run.status,
        held_out=run.held_out,
        samples=run.samples,
        sample_rate_hz=run.sample_rate_hz,
        size_bytes=run.size_bytes,
        sha256=run.sha256,
        created=iso_time(run.created_at_s),
        removed=None if run.removed_at_s is None else iso_time(run.removed_at_s),
        file=f"{here}/file",
        data=f"{here}/data",
    )


def _data(run: AnyRun, samples: Samples) -> RunData:
    return RunData(
        id=run.id,
        start=samples.start,
        end=samples.end,
        step=samples.step,
        sample_rate_hz=samples.sample_rate_hz,
        time_s=samples.time_s.tolist(),
        channels={
            name: ChannelSamples(
                unit=unit, lowest=samples.lowest[name].tolist(), highest=samples.highest[name].tolist()
            )
            for name, unit in samples.units.items()
        },
    )
