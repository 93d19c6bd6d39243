"""The layers around the routes, in one place and one order."""

from __future__ import annotations

from fastapi import FastAPI
from fastapi.routing import iter_route_contexts
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from api.access.access import Access
from api.access.busy import RESERVE, BodyPace, Busy
from api.access.connections import Connections
from api.access.exposure import allowed_hosts, network_list
from api.access.guard import Guard
from api.access.hosts import HostList
from api.access.rules import Rules
from api.access.security_headers import SecurityHeaders

__all__ = ["protect", "routes_of"]

_BODY_GRACE_S = 30.0
_LEAST_BYTES_PER_S = (
    10_000.0  # an upload of 1 GB then takes a day at most; a network of a laboratory is 100 times faster
)


def routes_of(app: FastAPI) -> list[tuple[str, str]]:
    """Method and path of every route of the app, in the order in which it tries them."""
    return [
        (method, str(route.path))
        for route in iter_route_contexts(app.routes)
        for method in sorted((route.methods or set()) - {"HEAD"})
    ]


def protect(app: FastAPI, access: Access, connections: Connections | None = None) -> None:
    """Put the layers around the app, after its routes are in it; what is added first stands innermost."""
    settings = access.settings
    most = settings.connections if connections is None else connections.most
    rules = Rules(routes_of(app))
    app.add_middleware(Guard, access=access, rules=rules)
    app.add_middleware(BodyPace, grace_s=_BODY_GRACE_S, least_bytes_per_s=_LEAST_BYTES_PER_S)
    app.add_middleware(
        Busy,
        most=most - RESERVE,
        never=lambda method, path: rules.find(method, path).stops,
        scarce=lambda: connections is not None and connections.spares.scarce,
    )
    app.add_middleware(HostList, allowed=allowed_hosts(settings))
    app.add_middleware(SecurityHeaders)
    proxies = network_list(settings.trusted_proxies)
    if proxies:  # who the sender is and whether the way to the proxy is encrypted: only from proxies that are named
        app.add_middleware(ProxyHeadersMiddleware, trusted_hosts=proxies)
