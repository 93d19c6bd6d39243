"""Sign-in, keys and the audit log."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from api.access.audit import AuditRecord, audit_page
from api.access.identity import LOCAL, Identity
from api.access.keys import KeyRecord, KeyStore
from api.access.requests import COOKIE, SECURE_COOKIE, sender
from api.access.scopes import Scope
from api.access.snapshot import ABSOLUTE_S
from api.errors import Conflict
from api.routes.answers import MOST_NUMBER, iso_time
from api.service import ServiceDep

__all__ = ["router"]

router = APIRouter(prefix="/v1", tags=["access"])


class _Answer(BaseModel):
    model_config = ConfigDict(frozen=True)


class Who(_Answer):
    """Who is asking."""

    name: str
    scope: Scope
    key_id: str | None
    session: bool


class NewKey(BaseModel):
    """A key to be made."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = Field(min_length=1, max_length=100)
    scope: Scope
    expires_days: float | None = Field(default=365.0, gt=0, le=3650)
    """None: it does not expire."""


class KeyAnswer(_Answer):
    """What is known of a key."""

    id: str
    name: str
    scope: Scope
    created: str
    created_by: str
    expires: str | None
    used: str | None
    """To about a minute."""
    revoked: str | None


class NewKeyAnswer(KeyAnswer):
    """A key that was just made; ``key`` is shown this once."""

    key: str = Field(repr=False)


class KeyList(_Answer):
    """All keys, the oldest first."""

    keys: list[KeyAnswer]


class AuditAnswer(_Answer):
    """One action: who, from where, what, on what, with which outcome, and when by the store's clock."""

    number: int
    at: str
    who: str
    key_id: str | None
    address: str
    action: str
    target: str
    status: int
    outcome: str


class AuditList(_Answer):
    """Actions, the newest first; ``next_before`` is ``before`` of the next page."""

    audit: list[AuditAnswer]
    next_before: int | None


@router.post("/session", status_code=201)
def sign_in(request: Request, response: Response, service: ServiceDep) -> Who:
    """Sign in to the page with a key in the Authorization header: answers with a cookie."""
    identity = _identity(request)
    if not identity.key_id or identity.session:
        raise Conflict("sign in with a key: send it as 'Authorization: Bearer dr_…'")
    token = service.access.keyring.sign_in(identity)
    secure = request.url.scheme == "https"
    response.set_cookie(
        SECURE_COOKIE if secure else COOKIE,
        token,
        max_age=int(ABSOLUTE_S),
        path="/",
        secure=secure,
        httponly=True,
        samesite="strict",
    )
    return _who(identity)


@router.get("/session")
def session(request: Request) -> Who:
    """Who the service takes you for."""
    return _who(_identity(request))


@router.delete("/session", status_code=204)
def sign_out(request: Request, response: Response, service: ServiceDep) -> None:
    """Sign out of the page: the session ends here and in the browser."""
    token = sender(request.scope).cookie
    if token:
        service.access.keyring.sign_out(token)
    secure = request.url.scheme == "https"
    response.delete_cookie(SECURE_COOKIE if secure else COOKIE, path="/", secure=secure, httponly=True)
    response.headers["Clear-Site-Data"] = '"cache", "storage"'


@router.post("/keys", status_code=201)
def create_key(body: NewKey, request: Request, response: Response, service: ServiceDep) -> NewKeyAnswer:
    """Make a key. The first one is made on the machine itself, with `damper-rig key create`."""
    identity = _identity(request)
    if identity is LOCAL:
        raise Conflict("the first key is made on the machine itself: damper-rig key create NAME --scope admin")
    made, text = KeyStore(service.database).create(
        body.name, body.scope, expires_days=body.expires_days, created_by=identity.who
    )
    service.access.keyring.refresh()
    response.headers["Location"] = f"/v1/keys/{made.id}"
    return NewKeyAnswer(**dict(_key(made)), key=text)


@router.get("/keys")
def list_keys(service: ServiceDep) -> KeyList:
    """All keys without what opens anything."""
    return KeyList(keys=[_key(one) for one in KeyStore(service.database).every()])


@router.delete("/keys/{key_id}")
def revoke_key(key_id: str, service: ServiceDep) -> KeyAnswer:
    """Revoke a key and every session that was opened with it."""
    revoked = KeyStore(service.database).revoke(key_id)
    service.access.keyring.refresh()
    return _key(revoked)


@router.get("/audit")
def audit(
    service: ServiceDep,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
    before: Annotated[int | None, Query(ge=1, le=MOST_NUMBER)] = None,
) -> AuditList:
    """Every action on hardware, queues, campaigns and keys, the newest first."""
    found = audit_page(service.database, limit=limit, before=before)
    more = found[-1].number if len(found) == limit else None
    return AuditList(audit=[_entry(one) for one in found], next_before=more)


def _identity(request: Request) -> Identity:
    identity = request.state.identity
    assert isinstance(identity, Identity)  # the guard has let the request pass
    return identity


def _who(identity: Identity) -> Who:
    return Who(name=identity.name, scope=identity.scope, key_id=identity.key_id or None, session=identity.session)


def _key(record: KeyRecord) -> KeyAnswer:
    return KeyAnswer(
        id=record.id,
        name=record.name,
        scope=record.scope,
        created=iso_time(record.created_at_s),
        created_by=record.created_by,
        expires=None if record.expires_at_s is None else iso_time(record.expires_at_s),
        used=None if record.used_at_s is None else iso_time(record.used_at_s),
        revoked=None if record.revoked_at_s is None else iso_time(record.revoked_at_s),
    )


def _entry(record: AuditRecord) -> AuditAnswer:
    values = {**asdict(record), "key_id": record.key_id or None}
    return AuditAnswer(at=iso_time(values.pop("at_s")), **values)
