"""Requests that create something: once for each ``Idempotency-Key``."""

from __future__ import annotations

import hashlib
from collections.abc import AsyncIterator, Callable
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

__all__ = ["CREATED", "Asked", "Creation", "CreationDep", "IdempotencyKey", "created", "json_answer"]

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
    asked = Asked(request, idempotency_key)
    if idempotency_key is not None:
        asked.read(await request.body())
    return asked.creation()


class Asked:
    """A request with this Idempotency-Key, whose body is read in as many pieces as it comes in."""

    def __init__(self, request: Request, key: str | None) -> None:
        self._request, self._key, self._person = request, key, person(request)
        self._digest = hashlib.sha256(f"{self._person}\n".encode() + request.scope["query_string"] + b"\n")

    def read(self, piece: bytes) -> None:
        self._digest.update(piece)

    async def stream(self) -> AsyncIterator[bytes]:
        """The pieces of the body, as they come."""
        async for piece in self._request.stream():
            self.read(piece)
            yield piece

    def creation(self) -> Creation:
        """What it asks for; call it when the body has been read."""
        service = service_of(self._request)
        if self._key is None:
            return Creation(service=service, person=self._person, request=None)
        address = f"{self._request.method} {self._request.url.path}"[:200]
        keyed = KeyedRequest(key=self._key, address=address, fingerprint=self._digest.hexdigest())
        return Creation(service=service, person=self._person, request=keyed)


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
