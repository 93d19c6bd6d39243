"""What every route needs, in one table; a route that stands not in it is open to administrators only.

A test walks the routes of the app: each must stand here, and each line must be a route.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from starlette.routing import compile_path

from api.access.scopes import Scope

__all__ = ["RULES", "Rule", "Rules"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """What a route needs, and how it is treated."""

    scope: Scope | None  # None: open to everybody, because it says nothing about campaigns, rigs or keys
    action: str = ""  # its name in the audit log; empty: it changes nothing that the log is for
    stops: bool = False  # ends motion: never slowed down, never refused because the service is busy


_OPEN = Rule(scope=None)
_READ = Rule(scope=Scope.READ)
_ADMIN = Rule(scope=Scope.ADMIN)


def _schedule(action: str = "", *, stops: bool = False) -> Rule:
    return Rule(scope=Scope.SCHEDULE, action=action, stops=stops)


def _operate(action: str) -> Rule:
    return Rule(scope=Scope.OPERATE, action=action)


def _admin(action: str) -> Rule:
    return Rule(scope=Scope.ADMIN, action=action)


_CAMPAIGN, _RIG = "/v1/campaigns/{campaign_id}", "/v1/rigs/{rig}"
_RUN = "/v1/runs/{run_id}"
_JOB, _EXPLANATION = "/v1/jobs/{job_id}", "/v1/explanations/{explanation_id}"

RULES: dict[tuple[str, str], Rule] = {
    # the page itself is the same for everybody; what it shows comes from the routes below
    ("GET", "/"): _OPEN,
    ("GET", "/sign-in"): _OPEN,
    ("GET", "/static/plotly.min.js"): _OPEN,
    ("GET", "/static/{name}"): _OPEN,
    ("GET", "/healthz"): _OPEN,
    ("GET", "/v1/health/live"): _OPEN,
    ("GET", "/v1/health/ready"): _OPEN,
    ("GET", "/metrics"): _READ,
    ("GET", "/docs"): _READ,
    ("GET", "/openapi.json"): _READ,
    # sign-in, keys, audit
    ("POST", "/v1/session"): Rule(scope=Scope.READ, action="session.sign-in"),
    ("GET", "/v1/session"): _READ,
    ("DELETE", "/v1/session"): Rule(scope=Scope.READ, action="session.sign-out"),
    ("POST", "/v1/keys"): _admin("key.create"),
    ("GET", "/v1/keys"): _ADMIN,
    ("DELETE", "/v1/keys/{key_id}"): _admin("key.revoke"),
    ("GET", "/v1/audit"): _ADMIN,
    # campaigns
    ("POST", "/v1/campaigns"): _schedule("campaign.submit"),
    ("POST", "/v1/campaigns/check"): _schedule(),
    ("GET", "/v1/campaigns"): _READ,
    ("GET", _CAMPAIGN): _READ,
    ("DELETE", _CAMPAIGN): _schedule("campaign.delete"),
    ("POST", f"{_CAMPAIGN}/retry"): _schedule("campaign.retry"),
    ("POST", f"{_CAMPAIGN}/move"): _operate("campaign.move"),
    ("POST", f"{_CAMPAIGN}/abort"): _schedule("campaign.abort", stops=True),
    ("POST", f"{_CAMPAIGN}/stop"): _schedule("campaign.stop", stops=True),
    ("POST", f"{_CAMPAIGN}/hold"): _operate("campaign.hold"),
    ("POST", f"{_CAMPAIGN}/resume"): _operate("campaign.resume"),
    ("POST", f"{_CAMPAIGN}/confirm"): _operate("campaign.confirm"),
    ("GET", f"{_CAMPAIGN}/runs"): _READ,
    ("GET", f"{_CAMPAIGN}/runs/{{run_id}}"): _READ,
    ("GET", f"{_CAMPAIGN}/runs/{{run_id}}/loops"): _READ,
    ("POST", "/v1/tests/draw"): _schedule(),
    # rigs
    ("GET", "/v1/rigs"): _READ,
    ("POST", "/v1/rigs"): _admin("rig.register"),
    ("POST", "/v1/rigs/resume"): _operate("queue.resume"),
    ("GET", _RIG): _READ,
    ("PATCH", _RIG): _admin("rig.change"),  # its envelope and interlocks: what keeps a test within safe limits
    ("GET", f"{_RIG}/events"): _READ,
    ("GET", f"{_RIG}/queue"): _READ,
    ("POST", f"{_RIG}/pause"): _operate("queue.pause"),
    ("POST", f"{_RIG}/resume"): _operate("queue.resume"),
    ("POST", f"{_RIG}/reserve"): _operate("rig.reserve"),
    ("POST", f"{_RIG}/release"): _operate("rig.release"),
    ("POST", f"{_RIG}/stop"): _schedule("rig.stop", stops=True),
    ("POST", f"{_RIG}/make-safe"): _schedule("rig.make-safe", stops=True),
    ("GET", "/v1/live"): _READ,
    # runs and jobs
    ("POST", "/v1/runs"): _schedule(),
    ("GET", "/v1/runs"): _READ,
    ("GET", _RUN): _READ,
    ("DELETE", _RUN): _schedule("run.remove"),
    ("GET", f"{_RUN}/file"): _READ,
    ("GET", f"{_RUN}/data"): _READ,
    ("GET", "/v1/specimens"): _READ,
    ("POST", "/v1/designs"): _schedule("design.create"),
    ("POST", "/v1/designs/file"): _schedule("design.create"),
    ("GET", "/v1/designs"): _READ,
    ("GET", "/v1/designs/{design}"): _READ,
    ("DELETE", "/v1/designs/{design}"): _schedule("design.delete"),
    ("POST", "/v1/models"): _schedule("model.create"),
    ("GET", "/v1/models"): _READ,
    ("GET", "/v1/models/{model_id}"): _READ,
    ("GET", "/v1/models/{model_id}/model.json"): _READ,
    ("DELETE", "/v1/models/{model_id}"): _schedule("model.delete"),
    ("POST", "/v1/jobs"): _schedule(),
    ("GET", "/v1/jobs"): _READ,
    ("GET", _JOB): _READ,
    ("POST", f"{_JOB}/cancel"): _schedule(),
    ("GET", f"{_JOB}/files/{{name}}"): _READ,
    ("POST", "/v1/explanations"): _schedule(),
    ("GET", "/v1/explanations"): _READ,
    ("GET", _EXPLANATION): _READ,
    ("POST", f"{_EXPLANATION}/cancel"): _schedule(),
    ("POST", f"{_EXPLANATION}/campaign"): _schedule("campaign.submit"),
    ("GET", f"{_EXPLANATION}/report.json"): _READ,
    ("GET", f"{_EXPLANATION}/report.html"): _READ,
    ("GET", f"{_EXPLANATION}/model.json"): _READ,
    ("GET", f"{_EXPLANATION}/evidence.h5"): _READ,
}

_UNKNOWN_PATH = _READ  # it is answered with 404, to those who may read


class Rules:
    """The rule of each request, found before anything of it is read or parsed."""

    def __init__(self, routes: Iterable[tuple[str, str]]) -> None:
        """``routes``: method and path template of each route of the app, in the order in which the app tries them."""
        self._exact: dict[tuple[str, str], Rule] = {}
        self._patterns: list[tuple[str, re.Pattern[str], Rule]] = []
        for method, path in routes:
            rule = RULES.get((method, path), _ADMIN)
            if "{" in path:
                self._patterns.append((method, compile_path(path)[0], rule))
            else:
                self._exact.setdefault((method, path), rule)

    def find(self, method: str, path: str) -> Rule:
        """The rule of a request."""
        method = "GET" if method == "HEAD" else method
        exact = self._exact.get((method, path))
        if exact is not None:
            return exact
        fits = (rule for of, pattern, rule in self._patterns if of == method and pattern.match(path))
        return next(fits, _UNKNOWN_PATH)
