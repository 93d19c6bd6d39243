"""What a client does with the service."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Mapping
from hashlib import sha256
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from urllib.parse import quote
from uuid import uuid4

from api.client.answers import (
    Campaign,
    Rig,
    RigStop,
    RunFile,
    campaign_of,
    campaigns_of,
    rig_of,
    rig_stop_of,
    rigs_of,
    runs_of,
)
from api.client.connection import Connection, Repeat
from api.client.credentials import Service
from api.client.download import download, file_name
from api.errors import InputError, NotFound, ServiceError, one_line

__all__ = ["Client"]

POLL_S = 0.5
PATIENCE_S = 60.0  # that a watched campaign's service may not answer


class Client:
    """One service over HTTP; safe to use from many threads.

    Every call ends by its deadline. It raises InputError, NotFound, Conflict or TooLarge with the service's own words
    where it refuses, ServiceError where it does not answer. What may let a rig move is never sent twice.

    >>> from api.client import Client, Service
    >>> with Client(Service(url="http://127.0.0.1:8420")) as client:  # doctest: +SKIP
    ...     campaign = client.submit({"name": "…", "rig": "…", "specimen": "…", "tests": [...]})
    ...     client.watch(campaign.id).state
    """

    def __init__(self, service: Service, *, connection: Connection | None = None) -> None:
        self._connection = connection or Connection(service)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        self._connection.close()

    def submit(self, body: Mapping[str, Any], *, key: str = "") -> Campaign:
        """Schedule a campaign (the keys of POST /v1/campaigns) once, however often it is sent with the same ``key``.

        Any: JSON.
        """
        headers = {"idempotency-key": key or uuid4().hex}
        return campaign_of(self._post("/v1/campaigns", dict(body), repeat=Repeat.IF_NOT_DONE, headers=headers))

    def send_plan(self, file: Path) -> str:
        """Store a plan or excitation file as a design, which is named after it and its content; returns its id.

        Raises InputError where the file cannot be read.
        """
        try:
            content = file.read_bytes()
        except OSError as error:
            raise InputError(f"{file}: cannot be read: {one_line(error)}") from error
        name = f"{file.stem[:100]} {sha256(content).hexdigest()[:12]}"
        try:
            return str(self._get(f"/v1/designs/{_part(name)}")["id"])
        except NotFound:
            query = {"file": _plain(file.name), "name": name}
            headers = {"idempotency-key": uuid4().hex, "content-type": "application/octet-stream"}
            made = self._connection.json(
                "POST", "/v1/designs/file", repeat=Repeat.ALWAYS, query=query, headers=headers, file=content
            )
            return str(made["id"])

    def campaign(self, campaign_id: str) -> Campaign:
        return campaign_of(self._get(f"/v1/campaigns/{_part(campaign_id)}"))

    def campaigns(self, *, limit: int = 50, state: str = "") -> tuple[Campaign, ...]:
        """The newest campaigns first, at most 200."""
        query: dict[str, str | int] = {"limit": limit} | ({"state": state} if state else {})
        return campaigns_of(self._get("/v1/campaigns", query))

    def hold(self, campaign_id: str) -> Campaign:
        """Bring it to rest under power, until it is resumed."""
        return self._ask(campaign_id, "hold", Repeat.ALWAYS)

    def resume(self, campaign_id: str) -> Campaign:
        """Go on with a campaign that is held: the rig moves."""
        return self._ask(campaign_id, "resume", Repeat.IF_NOT_DONE)

    def stop(self, campaign_id: str) -> Campaign:
        """End it: to rest, back to mid-stroke without current, power off."""
        return self._ask(campaign_id, "stop", Repeat.ALWAYS)

    def abort(self, campaign_id: str) -> Campaign:
        """End it: to rest, power off where the piston stands."""
        return self._ask(campaign_id, "abort", Repeat.ALWAYS)

    def runs(self, campaign_id: str) -> tuple[RunFile, ...]:
        """The captured runs of a campaign, in order."""
        return runs_of(self._get(f"/v1/campaigns/{_part(campaign_id)}/runs"))

    def fetch(
        self, run: RunFile, folder: Path, *, name: str = "", tell: Callable[[float], None] = lambda done: None
    ) -> Path:
        """Download a run file into a folder, checked by its SHA-256; an interrupted download is resumed."""
        to = folder / (name or file_name(run))
        download(self._connection, run, to, tell=tell)
        return to

    def watch(
        self,
        campaign_id: str,
        *,
        tell: Callable[[Campaign], None] = lambda campaign: None,
        within_s: float | None = None,
        poll_s: float = POLL_S,
    ) -> Campaign:
        """The campaign when it has ended; ``tell`` gets it as often as it is read. Watching never stops a rig.

        Raises ServiceError where it has not ended within ``within_s``, or the service is gone for a minute.
        """
        begun = answered = time.monotonic()
        while True:
            try:
                campaign = self.campaign(campaign_id)
                answered = time.monotonic()
                tell(campaign)
                if campaign.has_ended:
                    return campaign
            except ServiceError:
                if time.monotonic() - answered > PATIENCE_S:
                    raise
            if within_s is not None and time.monotonic() - begun > within_s:
                raise ServiceError(f"the campaign has not ended within {within_s:g} s")
            time.sleep(poll_s)

    def rigs(self) -> tuple[Rig, ...]:
        """Every rig that the service knows."""
        return rigs_of(self._get("/v1/rigs"))

    def resume_queue(self, rig: str) -> Rig:
        """Let the campaigns that wait for a rig start again, after a look at the rig: it may move at once."""
        return rig_of(self._post("/v1/rigs/resume", {"rig": rig}, repeat=Repeat.IF_NOT_DONE))

    def pause_queue(self, rig: str, reason: str = "") -> Rig:
        """Let no further campaign of a rig start; the one that runs goes on."""
        return rig_of(self._post(f"{self._rig(rig)}/pause", {"reason": reason}, repeat=Repeat.ALWAYS))

    def stop_rig(self, rig: str) -> RigStop:
        """Stop whatever moves on a rig; its queue pauses. ServiceError: it was not acknowledged, press the button."""
        return rig_stop_of(self._post(f"{self._rig(rig)}/stop", None, repeat=Repeat.ALWAYS))

    def make_safe(self, rig: str) -> RigStop:
        """Stop a rig and switch it off, also where its worker has died; says whether it is at rest without current."""
        return rig_stop_of(self._post(f"{self._rig(rig)}/make-safe", None, repeat=Repeat.ALWAYS))

    def _rig(self, rig: str) -> str:
        """The path of a rig by its id, serial number or name; an address is looked up."""
        if "://" in rig:
            rig = next((one.id for one in self.rigs() if one.url == rig), rig)
        return f"/v1/rigs/{_part(rig)}"

    def _ask(self, campaign_id: str, wish: str, repeat: Repeat) -> Campaign:
        return campaign_of(self._post(f"/v1/campaigns/{_part(campaign_id)}/{wish}", None, repeat=repeat))

    def _get(self, path: str, query: Mapping[str, str | int] | None = None) -> Any:
        return self._connection.json("GET", path, repeat=Repeat.ALWAYS, query=query)

    def _post(self, path: str, body: Any, *, repeat: Repeat, headers: Mapping[str, str] | None = None) -> Any:
        return self._connection.json("POST", path, repeat=repeat, body=body, headers=headers)


def _part(campaign_id: str) -> str:
    return quote(campaign_id, safe="")


def _plain(name: str) -> str:
    """A name of a file as the service takes it."""
    stem, dot, ending = name.rpartition(".")
    return f"{re.sub(r'[^A-Za-z0-9 ._-]', '_', stem)[:90].lstrip(' ._-') or 'plan'}{dot}{ending.lower()}"
