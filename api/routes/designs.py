"""Designs: the tests of a plan, stored under a name that campaigns give."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar

from fastapi import APIRouter, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from pydantic import BaseModel, JsonValue
from starlette.requests import ClientDisconnect

from api.campaigns.new_campaign import check_reads_no_file, plan_of
from api.campaigns.texts import check_text
from api.campaigns.typed_tests import TestConfig
from api.errors import InputError, TooSlow
from api.findings import Findings, Refused
from api.routes.answers import Answer, iso_time
from api.routes.creation import Asked, Creation, CreationDep, IdempotencyKey
from api.routes.files import stated_length
from api.routes.paging import PageDep
from api.service import Service, ServiceDep
from api.store.designs import Design
from api.store.samples import KIND, names_of_samples, plays_samples
from excitation import Test, TestPlan
from excitation.plan import MakeExcitation, conditions_of, config_of

__all__ = ["router"]

router = APIRouter(prefix="/v1/designs", tags=["designs"])

_MOST_TESTS = 500


@dataclass(frozen=True, kw_only=True)
class NewDesign:
    """The tests of a plan under a name. Raises Refused, which lists everything that is wrong."""

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}

    name: str
    tests: list[TestConfig] = field(repr=False)
    warm_up: TestConfig | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        found = Findings()
        with found.at("name"):
            check_text("name", self.name, 200)
        with found.at("tests"):
            if not 0 < len(self.tests) <= _MOST_TESTS:
                raise InputError(f"tests has {len(self.tests)} entries: a design has 1 … {_MOST_TESTS}")
            for number, config in enumerate(self.tests):
                with found.at("tests", number):
                    check_reads_no_file(config)
        found.refuse()

    def plan(self, make: MakeExcitation) -> TestPlan:
        """Its plan, with samples as ``make`` reads them; raises Refused, which lists everything that is wrong."""
        found = Findings()
        with found.at():
            return plan_of(self.tests, self.warm_up, make)
        raise Refused(found.found)


class DesignSummary(Answer):
    """A stored design."""

    number: int
    id: str
    name: str
    tests: list[str]
    duration_s: float
    sha256: str
    created: str


class DesignStored(DesignSummary):
    """A design that was just stored, and what to know before it is played."""

    warnings: list[str]


class DesignAnswer(DesignSummary):
    """A stored design with the configurations of its tests."""

    configurations: list[dict[str, JsonValue]]
    warm_up: dict[str, JsonValue] | None


class DesignList(Answer):
    """Designs, the newest first; ``next_cursor`` is ``cursor`` of the next page."""

    designs: list[DesignSummary]
    next_cursor: str | None


@router.post("", status_code=201, response_model=DesignStored)
def create(body: NewDesign, service: ServiceDep, creation: CreationDep) -> Response:
    """Store the tests of a plan under a name."""
    return _store(service, creation, body, body.plan(service.runs.samples.excitations()))


@router.post(
    "/file",
    status_code=201,
    response_model=DesignStored,
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
        }
    },
)
async def create_from_file(
    request: Request,
    service: ServiceDep,
    file: Annotated[
        str,
        Query(
            pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}\.(h5|csv|toml|mat|drv|rsp)$",
            description="Name of the file; its ending says the format, as for `damper-rig run`.",
            examples=["matrix.csv"],
        ),
    ],
    name: Annotated[str, Query(max_length=200, description="Of the design; default: that of the file.")] = "",
    idempotency_key: IdempotencyKey = None,
) -> Response:
    """Store the excitation or plan file in the body of the request; what no design makes again is kept as samples."""
    title = name or Path(file).stem
    check_text("name", title, 200)
    await run_in_threadpool(service.runs.check_room)
    try:
        asked = Asked(request, idempotency_key)
        async with service.runs.samples.receive(file, asked.stream(), length=stated_length(request)) as found:
            creation = asked.creation()

            def stored() -> Response:
                design = NewDesign(name=title, tests=found.tests, warm_up=found.warm_up)
                return _store(service, creation, design, design.plan(found.make), keep=found.keep)

            return await run_in_threadpool(stored)  # minutes, where many tests are designed
    except ClientDisconnect as error:
        raise TooSlow(f"{file}: the connection ended before the file: send it again") from error


@router.get("")
def list_designs(service: ServiceDep, page: PageDep) -> DesignList:
    """The newest designs first."""
    found = service.designs.newest(limit=page.limit, before=page.before)
    after = page.next([one.number for one in found])
    return DesignList(designs=[_summary(one) for one in found], next_cursor=after.cursor)


@router.get("/{design}")
def one(design: str, service: ServiceDep) -> DesignAnswer:
    """One design, by its id or name."""
    found = service.designs.one(design)
    return DesignAnswer(
        **dict(_summary(found)),
        configurations=[dict(test) for test in found.tests],
        warm_up=None if found.warm_up is None else dict(found.warm_up),
    )


@router.delete("/{design}", status_code=204)
def delete(design: str, service: ServiceDep) -> None:
    """Delete a design, by its id or name, and its samples where no other design and no open campaign names them.

    Campaigns that were made from it keep their tests.
    """
    deleted = service.designs.delete(design)
    service.runs.samples.remove_unused(names_of_samples((*deleted.tests, deleted.warm_up)))


def _store(
    service: Service, creation: Creation, new: NewDesign, plan: TestPlan, *, keep: Callable[[], None] = lambda: None
) -> Response:
    """The answer for a design that is stored with the samples that ``keep`` stores."""
    from excitation.analysis import spoiled_in  # with scipy 0.2 s to import: not at the start of the service

    tests = [_config(test, given) for test, given in zip(plan.tests, new.tests, strict=True)]
    warm_up = None if plan.warm_up is None or new.warm_up is None else _config(plan.warm_up, new.warm_up)

    warnings = list(spoiled_in(plan))

    def made() -> tuple[BaseModel, str]:
        keep()
        service.runs.samples.hold((*tests, warm_up))
        design = service.designs.create(new.name, tests, warm_up, plan.duration_s)
        return DesignStored(**dict(_summary(design)), warnings=warnings), f"/v1/designs/{design.id}"

    return creation.answer(made)


def _config(test: Test, given: Mapping[str, Any]) -> Mapping[str, Any]:
    """The configuration that makes a test again, defaults left out. Any: JSON."""
    if not plays_samples(given):
        return config_of(test)
    return {"name": test.name, "kind": KIND, "sha256": given["sha256"], **conditions_of(test)}


def _summary(design: Design) -> DesignSummary:
    return DesignSummary(
        number=design.number,
        id=design.id,
        name=design.name,
        tests=[str(test.get("name", "")) for test in design.tests],
        duration_s=design.duration_s,
        sha256=design.sha256,
        created=iso_time(design.created_at_s),
    )
