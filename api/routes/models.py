"""Models: files that the one reader of models has accepted."""

from __future__ import annotations

import json
from typing import Annotated

from fastapi import APIRouter, Body, Response
from pydantic import BaseModel, JsonValue

from api.errors import InputError
from api.jobs.model_option import check_model, model_name
from api.routes.answers import Answer, iso_time
from api.routes.creation import CreationDep
from api.routes.paging import PageDep
from api.service import ServiceDep
from api.store.models import StoredModel

__all__ = ["router"]

router = APIRouter(prefix="/v1/models", tags=["models"])

ModelFile = Annotated[
    dict[str, JsonValue],
    Body(
        description="The content of a model file, as `damper-rig fit` writes it.",
        examples=[
            {
                "format": "damper-rig/model",
                "format_version": 1,
                "kind": "physical",
                "name": "linear damper",
                "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 1500.0}}]},
            }
        ],
    ),
]


class ModelSummary(Answer):
    """A stored model."""

    number: int
    id: str
    name: str
    kind: str
    sha256: str
    created: str
    file: str


class ModelAnswer(ModelSummary):
    """A stored model with the content of its file."""

    model: dict[str, JsonValue]


class ModelList(Answer):
    """Models, the newest first; ``next_cursor`` is ``cursor`` of the next page."""

    models: list[ModelSummary]
    next_cursor: str | None


@router.post("", status_code=201, response_model=ModelSummary)
def create(body: ModelFile, service: ServiceDep, creation: CreationDep) -> Response:
    """Store a model file; refused with the message of the command line where it is none."""
    check_model(body)
    name = model_name(body)
    if len(name) > 200 or not name.isprintable():
        raise InputError(f"model: name is {name!a:.60}: it must be at most 200 printable characters")

    def made() -> tuple[BaseModel, str]:
        kept = service.models.create(name=name, kind=str(body.get("kind", "physical")), model=body)
        return _summary(kept), f"/v1/models/{kept.id}"

    return creation.answer(made)


@router.get("")
def list_models(service: ServiceDep, page: PageDep) -> ModelList:
    """The newest models first."""
    found = service.models.newest(limit=page.limit, before=page.before)
    after = page.next([one.number for one in found])
    return ModelList(models=[_summary(one) for one in found], next_cursor=after.cursor)


@router.get("/{model_id}")
def one(model_id: str, service: ServiceDep) -> ModelAnswer:
    """One model."""
    kept = service.models.one(model_id)
    return ModelAnswer(**dict(_summary(kept)), model=json.loads(kept.content))


@router.get("/{model_id}/model.json", response_class=Response, responses={200: {"content": {"application/json": {}}}})
def file(model_id: str, service: ServiceDep) -> Response:
    """The model file."""
    kept = service.models.one(model_id)
    return Response(kept.content, media_type="application/json", headers={"ETag": f'"{kept.sha256}"'})


@router.delete("/{model_id}", status_code=204)
def delete(model_id: str, service: ServiceDep) -> None:
    """Delete a model; jobs keep their own copy."""
    service.models.delete(model_id)


def _summary(kept: StoredModel) -> ModelSummary:
    return ModelSummary(
        number=kept.number,
        id=kept.id,
        name=kept.name,
        kind=kept.kind,
        sha256=kept.sha256,
        created=iso_time(kept.created_at_s),
        file=f"/v1/models/{kept.id}/model.json",
    )
