"""The page in a browser, from sign-in to the sheet: a real service, a real simulated rig."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.api.browser import Page, browser
from tests.starting import Started

pytestmark = [pytest.mark.browser, pytest.mark.slow]

LIVE = "(document.querySelector('#fv').data || []).find(trace => trace.name.endsWith('(live)'))"
VIEWS = ("live", "schedule", "runs", "keys", "audit")


@dataclass(frozen=True, kw_only=True)
class Desk:
    """Somebody who is signed in before the page."""

    page: Page
    service: Started
    base: str
    rig: str
    key: str

    def fill(self, selector: str, text: str) -> None:
        self.page.evaluate(
            f"(node => {{ node.value = {text!r}; node.dispatchEvent(new Event('input', {{bubbles: true}})); }})"
            f"(document.querySelector({selector!r}))"
        )

    def click(self, selector: str) -> None:
        self.page.evaluate(f"document.querySelector({selector!r}).click()")

    def text(self, selector: str) -> str:
        return str(self.page.evaluate(f"document.querySelector({selector!r}).textContent"))

    def waits(self, expression: str, within_s: float = 60.0) -> None:
        self.page.wait_for(f"Boolean({expression})", within_s)

    def show(self, view: str) -> None:
        self.page.evaluate(f"location.hash = '#{view}'")
        self.waits(f"!document.querySelector('#{view}-view').hidden")

    def field(self, test: int, label: str) -> str:
        """The id of a field of the form, by its label."""
        found = self.page.evaluate(
            f"[...document.querySelectorAll('fieldset.test')[{test}].querySelectorAll('label')]"
            f".find(label => label.textContent.startsWith({label!r})).htmlFor"
        )
        return f"#{found}"


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory, chromium: Path) -> Iterator[Desk]:
    place = tmp_path_factory.mktemp("page")
    lab = str(place / "lab")
    command = [sys.executable, "-m", "api.cli", "key", "create", "Ada", "--scope", "admin", "--data", lab]
    key = subprocess.run(command, check=True, capture_output=True, text=True, timeout=120).stdout.strip()
    with ExitStack() as stack:
        rig = stack.enter_context(
            Started(["sim", "--listen", "modbus://127.0.0.1:0", "--seed", "3"], place / "sim.log")
        )
        service = stack.enter_context(Started(["serve", "--data", lab, "--port", "0"], place / "serve.log"))
        page = stack.enter_context(browser(chromium, place / "profile"))
        base = service.wait_until_ready(120.0)
        yield Desk(page=page, service=service, base=base, rig=rig.wait_until_ready(120.0), key=key)


@pytest.fixture(scope="module")
def signed_in(desk: Desk) -> Desk:
    desk.page.open(desk.base + "/")
    desk.waits("location.pathname === '/sign-in' && (document.querySelector('#go') || {}).disabled === false")
    desk.fill("#key", desk.key)
    desk.click("#go")
    desk.waits("location.pathname === '/' && (document.querySelector('#who') || {}).textContent === 'Ada (admin)'")
    desk.waits("document.querySelector('#link').textContent === 'live'")
    return desk


@pytest.fixture(scope="module")
def running(signed_in: Desk) -> Desk:
    """A campaign of two tests, scheduled by the form; the second of them runs."""
    desk = signed_in
    desk.show("schedule")
    for key, text in (("name", "valve map"), ("rig", desk.rig), ("specimen", "")):
        desk.fill(f"#new-{key}", text)
    desk.fill(desk.field(0, "Frequency"), "fast")
    desk.waits("!document.querySelector('#wrong-specimen').hidden")
    wrong = desk.page.evaluate(f"document.querySelector('{desk.field(0, 'Frequency')}-wrong').textContent")
    assert "frequency is 'fast'" in wrong
    assert desk.text("#checked") == "2 things must be changed."
    desk.fill("#new-specimen", "damper 7")
    desk.fill(desk.field(0, "Frequency"), "2")
    desk.click("#add-test")
    desk.fill(desk.field(1, "Cycles"), "1200")  # 10 min: it runs until a test of this module stops it
    desk.waits("document.querySelector('#checked').textContent.startsWith('It fits: 10 min')")
    desk.waits("(document.querySelector('#draw-time').data || [{}])[0].name === 'test 2'")
    drawn = desk.page.evaluate("Math.max(...document.querySelector('#draw-time').data[0].y)")
    assert drawn == pytest.approx(10.0, rel=0.01)  # mm
    desk.click("#submit")
    desk.waits("!document.querySelector('#live-view').hidden")
    desk.waits("document.querySelector('#nowtest').textContent === 'test 2'")
    desk.waits("document.querySelector('#nowphase').textContent === 'running'")
    return desk


def test_the_running_test_draws_continuous_loops_over_displacement_and_velocity(running: Desk) -> None:
    running.waits(f"({LIVE} || {{x: []}}).x.length > 600")  # more than two periods of 2 Hz
    live: dict[str, list[float | None]] = running.page.evaluate(f"(t => ({{x: t.x, y: t.y}}))({LIVE})")
    assert None not in live["x"]
    velocity = [v for v in live["x"] if v is not None]
    assert max(velocity) == pytest.approx(0.01 * 4e3 * 3.14159, rel=0.06)  # mm/s, of 10 mm at 2 Hz
    jumps = [abs(b - a) for a, b in pairwise(velocity)]
    assert max(jumps) < 0.06 * max(velocity)  # 2 ms of a sine, and its noise: no point was left out
    for reading in ("force", "degrees", "left", "place", "fifo"):
        running.waits(f"/[0-9]/.test(document.querySelector('#cell-{reading}').textContent)")
    assert running.text("#cell-state") == "running"


def test_what_has_the_focus_keeps_it_while_the_page_is_renewed(running: Desk) -> None:
    page = running.page
    page.evaluate("(window.kept = document.querySelector('#rigs .pausing input')).focus()")
    page.call("Input.insertText", text="leak at ")
    before = running.text("#cell-seen"), page.evaluate("document.querySelector('#nowbar').value")
    page.evaluate("new Promise(ready => setTimeout(ready, 3000))")
    assert page.evaluate("document.activeElement === window.kept")
    assert page.evaluate("document.querySelector('#nowbar').value") > before[1]
    page.call("Input.insertText", text="the seal")
    assert page.evaluate("window.kept.value") == "leak at the seal"


def test_with_reduced_motion_the_loops_move_every_two_seconds_and_nothing_is_animated(running: Desk) -> None:
    page = running.page
    page.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-reduced-motion", "value": "reduce"}])
    page.evaluate(
        """(react => {
          window.drawnAt = [];
          Plotly.react = (node, ...rest) => {
            if (node.id === 'fx') window.drawnAt.push(performance.now());
            return react(node, ...rest);
          };
        })(Plotly.react)"""
    )
    running.waits("window.drawnAt.length >= 3")
    drawn_at = page.evaluate("window.drawnAt")[1:]  # the first was asked for before
    assert min(after - before for before, after in pairwise(drawn_at)) > 1900.0
    assert page.evaluate("document.getAnimations().length") == 0
    page.call("Emulation.setEmulatedMedia", features=[])


def test_a_printed_chart_has_the_width_of_paper_and_then_that_of_the_window_again(running: Desk) -> None:
    page = running.page
    page.evaluate(
        """(react => {
          window.widths = [];
          Plotly.react = (node, traces, layout, ...rest) => {
            if (node.id === 'fx') window.widths.push(layout.width);
            return react(node, traces, layout, ...rest);
          };
        })(Plotly.react)"""
    )
    page.call("Page.printToPDF")
    running.waits("window.widths.includes(660)")  # A4 within its margins has 718 px, Letter 739
    running.waits("window.widths.at(-1) === document.querySelector('#fx').clientWidth")


def test_no_view_scrolls_sideways_in_a_narrow_window(running: Desk) -> None:
    running.page.call("Emulation.setDeviceMetricsOverride", width=375, height=800, deviceScaleFactor=1, mobile=False)
    try:
        for view in VIEWS:
            running.show(view)
            assert running.page.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), view
        running.show("live")
        lines = "(node => node.getBoundingClientRect().height / parseFloat(getComputedStyle(node).lineHeight))"
        assert running.page.evaluate(f"{lines}(document.querySelector('#name'))") < 2  # not one letter a line
    finally:
        running.page.call("Emulation.clearDeviceMetricsOverride")


def test_in_the_dark_page_and_charts_are_dark_and_text_stands_out(running: Desk) -> None:
    page = running.page
    for scheme, light in (("light", True), ("dark", False)):
        page.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        paper = "getComputedStyle(document.querySelector('#cell')).backgroundColor"
        ink = "getComputedStyle(document.querySelector('#cell-force')).color"
        assert (luminance(page.evaluate(paper)) > 0.5) is light
        chart = "getComputedStyle(document.querySelector('#fx .main-svg')).backgroundColor"
        running.waits(f"{chart} === {paper}")
        for text in ("#cell-force", "#cell-seen", "#facts", "#stop", "#rigs .hint", "#tests .state", "#hold"):
            assert contrast(page, text) >= 4.5, (scheme, text)
        assert (luminance(page.evaluate(ink)) < 0.5) is light
    page.call("Emulation.setEmulatedMedia", features=[])


def test_a_stop_ends_the_campaign_and_pauses_the_queue_and_the_runs_become_a_sheet(running: Desk) -> None:
    desk = running
    desk.page.evaluate(
        "window.said = []; new MutationObserver(() => said.push(document.querySelector('#cell .said').textContent))"
        ".observe(document.querySelector('#cell .said'), {childList: true, characterData: true, subtree: true})"
    )
    desk.click("#stop")
    assert desk.page.evaluate("said[0]").startswith("Stop sent at")  # at once, whatever the service does
    desk.waits("document.querySelector('#cell .said').textContent.startsWith('Stop: taken at')")
    desk.waits("document.querySelector('#state').textContent === 'aborted'")
    desk.waits("document.querySelector('#cell-campaign-state').textContent === 'queue paused'")
    desk.click("#safe")
    desk.waits("document.querySelector('#cell .said').textContent.includes('The rig: ')")
    desk.show("runs")
    desk.waits("document.querySelectorAll('#runs-rows tr').length === 2")  # the newest first: the one that was stopped
    desk.click("#runs-rows tr:last-child input")
    desk.waits("(document.querySelector('#runs-fv').data || []).length === 1")
    desk.click("#sheet")
    desk.waits("document.querySelector('#runs-actions + .said').textContent.startsWith('The sheet')")
    desk.waits("/done|failed/.test((document.querySelector('#jobs .state') || {}).textContent)", 300)  # of low priority
    assert desk.text("#jobs a") == "sheet.html", desk.text("#jobs")
    desk.click("#analysis")
    desk.waits("document.querySelector('#runs-actions + .said').textContent.startsWith('The runs are being analysed')")
    desk.waits("document.querySelectorAll('#jobs li').length === 2")
    desk.waits("/done|failed/.test((document.querySelector('#jobs .state') || {}).textContent)", 300)
    assert desk.text("#jobs a") == "analysis.html", desk.text("#jobs")
    assert desk.text("#jobs .name") == "Linear part and distortion"
    desk.show("audit")
    desk.waits("document.querySelector('#audit').textContent.includes('campaign.stop')")
    desk.show("keys")
    desk.waits("document.querySelector('#keys').textContent.includes('Ada')")
    # 401 before the sign-in and 422 of a plan that does not fit are noted; no rule of the page's policy was broken
    assert [one for one in desk.page.complaints if not re.search("a status of (401|422)", one)] == []
    desk.show("live")


def test_a_lost_service_is_told_within_two_seconds_with_what_to_do(signed_in: Desk) -> None:
    desk = signed_in
    desk.show("live")
    desk.waits("document.querySelector('#link').textContent === 'live'")
    desk.page.evaluate(
        """(() => {
          let [before, late] = [Date.now(), 0];  // by how much this browser is late, which a busy computer makes it
          const probe = setInterval(() => {
            late += Math.max(Date.now() - before - 40, 0);
            before = Date.now();
          }, 20);
          new MutationObserver(() => {
            window.lostTold ??= {at: Date.now(), late: late + Math.max(Date.now() - before - 40, 0)};
            clearInterval(probe);
          }).observe(document.querySelector('#lost'), {attributes: true});
        })()"""
    )
    killed_at = time.time()
    os.kill(desk.service.pid, signal.SIGKILL)
    desk.waits("window.lostTold")
    told = desk.page.evaluate("window.lostTold")
    assert (told["at"] - told["late"]) / 1e3 - killed_at < 2.0
    assert "press the emergency stop" in desk.text("#lost")
    assert "old" in desk.text("#lost-since")
    if desk.page.evaluate("!document.querySelector('#cell').hidden"):
        desk.click("#safe")
        desk.waits("document.querySelector('#cell .said').textContent.includes('press the emergency stop')")


def luminance(colour: str) -> float:
    """Relative luminance of a computed colour, as WCAG defines it."""
    parts = [float(part) / 255 for part in re.findall(r"[\d.]+", colour)[:3]]
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(page: Page, selector: str) -> float:
    """Contrast of a text against the nearest background that is not transparent."""
    found: dict[str, Any] = page.evaluate(
        f"""(() => {{
          const node = document.querySelector({selector!r});
          let behind = node;
          while (getComputedStyle(behind).backgroundColor === 'rgba(0, 0, 0, 0)') behind = behind.parentElement;
          return {{ ink: getComputedStyle(node).color, paper: getComputedStyle(behind).backgroundColor }};
        }})()"""
    )
    low, high = sorted((luminance(found["ink"]), luminance(found["paper"])))
    return (high + 0.05) / (low + 0.05)
