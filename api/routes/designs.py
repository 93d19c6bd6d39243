"""Designs: the tests of a plan, stored under a name that campaigns give."""

from __future__ import annotations

import asyncio
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, ClassVar

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, JsonValue

from api.campaigns.new_campaign import check_reads_no_file, check_text
from api.campaigns.typed_tests import TestConfig
from api.errors import InputError
from api.findings import Findings
from api.processes.run_reader import PlanContent
from api.routes.answers import Answer, iso_time
from api.routes.creation import CreationDep
from api.routes.paging import PageDep, link_pages, next_page
from api.service import Service, ServiceDep
from api.store.designs import Design
from excitation import TestPlan, plan_from_config
from excitation.plan import config_of

__all__ = ["router"]

router = APIRouter(prefix="/v1/designs", tags=["designs"])

_FILES = (".h5", ".csv", ".toml")
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
        if not found.found:
            with found.at():
                self.plan()
        found.refuse()

    def plan(self) -> TestPlan:
        if self.warm_up is not None:
            check_reads_no_file(self.warm_up)
        return plan_from_config({"tests": self.tests, **({} if self.warm_up is None else {"warm_up": self.warm_up})})


class DesignSummary(Answer):
    """A stored design."""

    number: int
    id: str
    name: str
    tests: list[str]
    duration_s: float
    sha256: str
    created: str


class DesignAnswer(DesignSummary):
    """A stored design with the configurations of its tests."""

    configurations: list[dict[str, JsonValue]]
    warm_up: dict[str, JsonValue] | None


class DesignList(Answer):
    """Designs, the newest first; ``next_cursor`` is ``cursor`` of the next page."""

    designs: list[DesignSummary]
    next_cursor: str | None


@router.post("", status_code=201, response_model=DesignSummary)
def create(body: NewDesign, service: ServiceDep, creation: CreationDep) -> Response:
    """Store the tests of a plan under a name."""
    return _store(service, creation, body.name, body.plan())


@router.post(
    "/file",
    status_code=201,
    response_model=DesignSummary,
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
    creation: CreationDep,
    file: Annotated[
        str,
        Query(
            pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}\.(h5|csv|toml)$",
            description="Name of the file; its ending says the format, as for `damper-rig run`.",
            examples=["matrix.csv"],
        ),
    ],
    name: Annotated[str, Query(max_length=200, description="Of the design; default: that of the file.")] = "",
) -> Response:
    """Store the excitation or plan file in the body of the request, which `damper-rig design` has made."""
    title = name or Path(file).stem
    check_text("name", title, 200)
    found = await _read(service, file, await request.body())

    def stored() -> Response:
        design = NewDesign(name=title, tests=found.tests, warm_up=found.warm_up)
        return _store(service, creation, title, design.plan())

    return await asyncio.to_thread(stored)


@router.get("")
def list_designs(service: ServiceDep, request: Request, response: Response, page: PageDep) -> DesignList:
    """The newest designs first."""
    found = service.designs.newest(limit=page.limit, before=page.before)
    after = next_page([one.number for one in found], page)
    link_pages(request, response, after.cursor)
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
    """Delete a design, by its id or name; campaigns that were made from it keep their tests."""
    service.designs.delete(design)


def _store(service: Service, creation: CreationDep, name: str, plan: TestPlan) -> Response:
    tests = [config_of(test) for test in plan.tests]
    warm_up = None if plan.warm_up is None else config_of(plan.warm_up)

    def made() -> tuple[BaseModel, str]:
        design = service.designs.create(name, tests, warm_up, plan.duration_s)
        return _summary(design), f"/v1/designs/{design.id}"

    return creation.answer(made)


async def _read(service: Service, name: str, content: bytes) -> PlanContent:
    """What is in an uploaded plan file; raises InputError, Busy or ExcitationFileError, which names the file."""
    if not content:
        raise InputError("the body is empty: send the content of an excitation or plan file")
    with tempfile.TemporaryDirectory(prefix="damper-rig-design-") as folder:
        path = Path(folder) / name
        await asyncio.to_thread(path.write_bytes, content)
        return await service.runs.reader.read_plan(path, name)


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
