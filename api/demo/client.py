"""The demonstration as a client of the service over HTTP."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx

from api.errors import InputError, ProcessError, one_line
from excitation.atomic import written_whole

__all__ = ["Client"]

CALL_S = 20.0
POLL_S = 0.2
ENDED = ("done", "failed", "aborted")


class Client:
    """Campaigns over HTTP; every call ends by its deadline with an answer or ProcessError. Any: JSON."""

    def __init__(self, base_url: str) -> None:
        # trust_env: a service on this machine is not reached through a proxy
        self._http = httpx.Client(base_url=base_url, timeout=CALL_S, trust_env=False)

    def close(self) -> None:
        self._http.close()

    def schedule(self, body: dict[str, Any]) -> dict[str, Any]:
        return self._json("POST", "/v1/campaigns", body)

    def follow(self, campaign_id: str, *, within_s: float, tell: Callable[[dict[str, Any]], None]) -> dict[str, Any]:
        """The campaign when it has ended; an interruption aborts it and waits for the rig."""
        try:
            return self._until_ended(campaign_id, within_s, tell)
        except BaseException:
            self._abort(campaign_id)
            raise

    def runs(self, campaign_id: str) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = self._json("GET", f"/v1/campaigns/{campaign_id}/runs")["runs"]
        return found

    def fetch(self, path: str, to: Path) -> None:
        """Download a run file, whole or not at all."""
        with written_whole(to, InputError) as temporary:
            temporary.write_bytes(self._call("GET", path).content)

    def _until_ended(self, campaign_id: str, within_s: float, tell: Callable[[dict[str, Any]], None]) -> dict[str, Any]:
        ends = time.monotonic() + within_s
        while time.monotonic() < ends:
            campaign = self._json("GET", f"/v1/campaigns/{campaign_id}")
            tell(campaign)
            if campaign["state"] in ENDED:
                return campaign
            time.sleep(POLL_S)
        raise ProcessError(f"the campaign has not ended within {within_s:g} s")

    def _abort(self, campaign_id: str) -> None:
        """Stop the rig; if that fails too, the end of the service stops it."""
        try:
            self._call("POST", f"/v1/campaigns/{campaign_id}/abort")
            self._until_ended(campaign_id, 10.0, lambda campaign: None)
        except ProcessError:
            return

    def _json(self, method: str, path: str, body: dict[str, Any] | None = None) -> dict[str, Any]:
        answer: dict[str, Any] = self._call(method, path, body).json()
        return answer

    def _call(self, method: str, path: str, body: dict[str, Any] | None = None) -> httpx.Response:
        try:
            response = self._http.request(method, path, json=body)
            response.raise_for_status()
        except httpx.HTTPStatusError as error:
            raise ProcessError(f"the service refused {method} {path}: {error.response.text[:300]}") from error
        except httpx.HTTPError as error:
            raise ProcessError(f"the service did not answer {method} {path}: {one_line(error)}") from error
        return response
