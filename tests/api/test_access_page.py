"""Signing in on the page, in Chromium, and a report that is shown without reaching anything."""

from __future__ import annotations

from pathlib import Path

import httpx
import plotly.graph_objects as go
import pytest
from fastapi import FastAPI
from fastapi.responses import HTMLResponse

from api.access.keys import KeyStore
from api.access.scopes import Scope
from api.access.security_headers import SecurityHeaders
from api.app import create_app
from api.settings import Settings
from api.store.database import Database
from tests.api.browser import browser
from tests.api.serving import serving


@pytest.mark.browser
def test_somebody_signs_in_sees_the_page_and_signs_out(tmp_path: Path, chromium: Path) -> None:
    settings = Settings(data_dir=tmp_path / "lab")
    with Database(settings.store_url) as database:
        key = KeyStore(database).create("Anna Berg", Scope.OPERATE, expires_days=None, created_by="test")[1]
    app = create_app(settings, with_workers=False)
    with serving(app) as client, browser(chromium, tmp_path / "profile") as page:
        page.open(str(client.base_url))
        page.wait_for("(document.querySelector('#go') || {}).disabled === false")
        assert page.evaluate("location.pathname") == "/sign-in"
        page.evaluate("document.querySelector('#key').value = 'dr_wrong'")
        page.evaluate("document.querySelector('#go').click()")
        page.wait_for("document.querySelector('#refused').textContent.includes('not known')")
        assert len(page.picture(tmp_path / "sign-in.png")) > 5_000
        assert all("401" in complaint for complaint in page.complaints)  # Chromium notes each refused request
        page.complaints.clear()
        page.evaluate(f"document.querySelector('#key').value = {key!r}")
        page.evaluate("document.querySelector('#go').click()")
        page.wait_for("location.pathname === '/' && document.querySelector('#link')?.textContent === 'live'")
        page.wait_for("document.querySelector('#who').textContent === 'Anna Berg (operate)'")
        assert page.evaluate("document.cookie") == ""
        assert page.evaluate("fetch('/v1/rigs').then(answer => answer.status)") == 200
        assert page.evaluate("fetch('/v1/campaigns/x/hold', {method: 'POST'}).then(answer => answer.status)") == 404
        page.complaints.clear()
        page.evaluate("document.querySelector('#sign-out').click()")
        page.wait_for("location.pathname === '/sign-in'")
        assert page.evaluate("fetch('/v1/rigs').then(answer => answer.status)") == 401
        assert httpx.get(f"{client.base_url}/v1/rigs", timeout=60).status_code == 401


@pytest.mark.browser
def test_before_its_script_has_come_the_sign_in_form_sends_nothing(tmp_path: Path, chromium: Path) -> None:
    app = create_app(Settings(data_dir=tmp_path / "lab"), with_workers=False)
    with serving(app) as client, browser(chromium, tmp_path / "profile") as page:
        page.call("Network.enable")
        page.call("Network.setBlockedURLs", urls=["*sign_in.js*"])
        page.open(f"{client.base_url}/sign-in")
        page.evaluate("document.querySelector('#key').value = 'dr_key'")
        page.evaluate("document.querySelector('#go').click()")
        page.evaluate("document.querySelector('#key').focus()")
        page.press("Enter")
        assert page.evaluate("location.href") == f"{client.base_url}/sign-in"
        assert page.evaluate("document.querySelector('#key').value") == "dr_key"


HOSTILE = """<script>
document.title = "drawn";
try { document.cookie; } catch (error) { document.title += ", " + error.name; }
fetch("/v1/campaigns").catch(() => { document.title += ", no fetch"; });
</script>"""


@pytest.mark.browser
def test_a_report_draws_and_reaches_neither_the_session_nor_the_service(tmp_path: Path, chromium: Path) -> None:
    app = FastAPI(openapi_url=None)
    figure = go.Figure(go.Scatter(x=[0.0, 1.0], y=[0.0, 2.0]))

    @app.get("/v1/report.html")
    def report() -> HTMLResponse:
        return HTMLResponse(figure.to_html(include_plotlyjs=True) + HOSTILE)

    @app.get("/v1/campaigns")
    def campaigns() -> dict[str, str]:
        return {"secret": "x"}

    app.add_middleware(SecurityHeaders)
    with serving(app) as client, browser(chromium, tmp_path / "profile") as page:
        page.open(f"{client.base_url}/v1/report.html")
        page.wait_for("document.querySelectorAll('.scatterlayer .trace').length === 1")
        page.wait_for("document.title.endsWith('no fetch')")
        assert page.evaluate("document.title") == "drawn, SecurityError, no fetch"
        assert page.evaluate("self.origin") == "null"
