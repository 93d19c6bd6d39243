"""Somebody who is signed in before the page of a service without workers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx

from api.access.keys import KeyStore
from api.access.scopes import Scope
from api.app import create_app
from api.settings import Settings
from api.store.database import Database
from tests.api.browser import Page, browser
from tests.api.serving import serving


@dataclass(frozen=True, kw_only=True)
class Front:
    page: Page
    client: httpx.Client
    database: Database

    def show(self, view: str) -> None:
        self.page.evaluate(f"location.hash = '#{view}'")
        self.page.wait_for(f"!document.querySelector('#{view}-view').hidden")

    def fill(self, selector: str, text: str) -> None:
        self.page.evaluate(
            f"(node => {{ node.value = {text!r}; node.dispatchEvent(new Event('input', {{bubbles: true}})); }})"
            f"(document.querySelector({selector!r}))"
        )

    def click(self, selector: str) -> None:
        self.page.evaluate(f"document.querySelector({selector!r}).click()")

    def says(self, selector: str, words: str) -> None:
        self.page.wait_for(f"document.querySelector({selector!r}).textContent.includes({words!r})")

    def names(self, path: str, of: str) -> list[str]:
        return [one["name"] for one in self.client.get(path).json()[of]]


@contextmanager
def at_front(place: Path, chromium: Path) -> Iterator[Front]:
    """The page of somebody who may do everything."""
    settings = Settings(data_dir=place / "lab")
    with ExitStack() as stack:
        database = stack.enter_context(Database(settings.store_url))
        key = KeyStore(database).create("Ada", Scope.ADMIN, expires_days=None, created_by="test")[1]
        client = stack.enter_context(serving(create_app(settings, with_workers=False)))
        client.headers["authorization"] = f"Bearer {key}"
        page = stack.enter_context(browser(chromium, place / "profile"))
        page.open(f"{client.base_url}/sign-in")
        page.wait_for("(document.querySelector('#go') || {}).disabled === false")
        page.evaluate(f"document.querySelector('#key').value = {key!r}")
        page.evaluate("document.querySelector('#go').click()")
        page.wait_for("location.pathname === '/' && document.querySelector('#link')?.textContent === 'live'")
        yield Front(page=page, client=client, database=database)
