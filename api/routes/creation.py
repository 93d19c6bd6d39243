"""Requests that create something: once for each ``Idempotency-Key``."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Header, Request, Response
from pydantic import BaseModel

from api.campaigns.acceptance import Wanted
from api.campaigns.new_campaign import NewCampaign
from api.campaigns.records import Campaign
from api.routes.person import person
from api.service import Service, service_of
from api.store.idempotency import GivenAnswer, KeyedRequest
from excitation import TestPlan

__all__ = ["CREATED", "Creation", "CreationDep", "IdempotencyKey", "created", "creation_of", "json_answer"]

CREATED = 201


@dataclass(frozen=True, slots=True, kw_only=True)
class Creation:
    """A request of a person that creates something; without a key it creates it every time."""

    service: Service
    person: str
    request: KeyedRequest | None

    def given(self) -> Response | None:
        """The answer that this request had before. Raises InputError where its key came with another body."""
        before = None if self.request is None else self.service.idempotency.given(self.request)
        return None if before is None else _response(before, again=True)

    def answer(self, create: Callable[[], tuple[BaseModel, str]]) -> Response:
        """The answer to the request. ``create`` stores what is new and returns the answer and its address.

        It is called in the transaction that keeps the key, and must not wait for anything else.
        """

        def made() -> GivenAnswer:
            return created(*create())

        def once() -> tuple[GivenAnswer, bool]:
            return (made(), False) if self.request is None else self.service.idempotency.once(self.request, made)

        given, again = self.service.group_commit.store(once)
        return _response(given, again=again)

    async def accept(self, new: NewCampaign, plan: TestPlan, answer: Callable[[Campaign], GivenAnswer]) -> Response:
        """The answer to the request for a campaign, which is stored together with others that come at once."""
        wanted = Wanted(new=new, plan=plan, created_by=self.person, request=self.request, answer=answer)
        given, again = await self.service.group_commit.stored(self.service.acceptance, wanted)
        return _response(given, again=again)


IdempotencyKey = Annotated[
    str | None,
    Header(
        min_length=1,
        max_length=255,
        pattern=r"^[\x21-\x7e]+$",
        description="A repeated request with the same key and body creates nothing and has the same answer.",
        examples=["8e03978e-40d5-43dd-bc93-6894a57f9324"],
    ),
]


async def _creation(request: Request, idempotency_key: IdempotencyKey = None) -> Creation:
    body = b"" if idempotency_key is None else await request.body()
    return creation_of(request, idempotency_key, body)


def creation_of(request: Request, key: str | None, body: bytes) -> Creation:
    """Of a request with this Idempotency-Key; ``body`` is its body, or the SHA-256 of one that was streamed."""
    service, who = service_of(request), person(request)
    if key is None:
        return Creation(service=service, person=who, request=None)
    digest = hashlib.sha256(f"{who}\n".encode() + request.scope["query_string"] + b"\n" + body)
    address = f"{request.method} {request.url.path}"[:200]
    keyed = KeyedRequest(key=key, address=address, fingerprint=digest.hexdigest())
    return Creation(service=service, person=who, request=keyed)


def created(answer: BaseModel, location: str) -> GivenAnswer:
    """The answer for something that was created, and its address."""
    return GivenAnswer(status=CREATED, location=location, answer=answer.model_dump_json())


def json_answer(answer: BaseModel) -> Response:
    """An answer that creates nothing, of a route that could have."""
    return Response(answer.model_dump_json(), media_type="application/json")


def _response(given: GivenAnswer, *, again: bool) -> Response:
    headers = {"Location": given.location}
    if again:
        headers["Idempotency-Replayed"] = "true"
    return Response(given.answer, status_code=given.status, media_type="application/json", headers=headers)


CreationDep = Annotated[Creation, Depends(_creation)]
