"""What the page sends: nothing before its scripts have come, once what creates something, and with patience."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.api.front import Front, at_front

pytestmark = pytest.mark.browser

# The answer to the next creation is lost on its way back: the service has done what was asked.
LOSE = """(() => {
  const real = window.fetch;
  window.fetch = async (...request) => {
    const answer = await real(...request);
    if (!request[1]?.headers?.["idempotency-key"]) return answer;
    window.fetch = real;
    throw new TypeError("lost");
  };
})()"""

SHOW_ALL = "document.querySelectorAll('[hidden]').forEach(node => { node.hidden = false; })"


@pytest.fixture(scope="module")
def front(tmp_path_factory: pytest.TempPathFactory, chromium: Path) -> Iterator[Front]:
    with at_front(tmp_path_factory.mktemp("requests"), chromium) as front:
        yield front


def test_before_its_scripts_have_come_no_form_of_the_page_sends_anything(front: Front) -> None:
    page, here = front.page, f"{front.client.base_url}/"
    page.call("Network.enable")
    page.call("Network.setBlockedURLs", urls=["*/live.js*"])
    try:
        page.open(here)
        page.evaluate(SHOW_ALL)
        forms = page.evaluate("[...document.forms].map(form => form.id)")
        assert len(forms) >= 4
        for form in forms:
            field = f"document.querySelector('#{form} input[type=text], #{form} input:not([type])')"
            page.evaluate(f"document.querySelectorAll('#{form} button').forEach(button => button.click())")
            if page.evaluate(f"{field} === null"):
                continue
            page.evaluate(f"{field}.value = 'kept'; {field}.focus()")
            page.press("Enter")
            assert page.evaluate(f"{field}.value") == "kept", form
        assert page.evaluate("location.href") == here
    finally:
        page.call("Network.setBlockedURLs", urls=[])
    page.open(here)
    page.wait_for("document.querySelector('#link').textContent === 'live'")
    for button in ("#submit", "#make-key"):
        page.wait_for(f"document.querySelector('{button}').disabled === false")


def test_a_campaign_whose_answer_was_lost_and_one_that_is_clicked_twice_are_created_once(front: Front) -> None:
    front.show("schedule")
    for key, text in (("name", "lost"), ("rig", "modbus://127.0.0.1:5020"), ("specimen", "damper 7")):
        front.fill(f"#new-{key}", text)
    front.says("#checked", "It fits")
    front.page.evaluate(LOSE)
    front.click("#submit")
    front.says("#wrong", "Press again")
    assert front.names("/v1/campaigns", "campaigns") == ["lost"]
    front.click("#submit")
    front.page.wait_for("!document.querySelector('#live-view').hidden")
    assert front.names("/v1/campaigns", "campaigns") == ["lost"]
    front.click("#submit")  # the second click of a double click: the form is out of sight by now
    front.says("#checked", "was accepted")
    assert front.names("/v1/campaigns", "campaigns") == ["lost"]
    front.page.evaluate("new Promise(ready => setTimeout(ready, 1200))")  # no double click takes as long
    front.click("#submit")
    front.page.wait_for("document.querySelectorAll('#campaigns li').length === 2")
    assert front.names("/v1/campaigns", "campaigns") == ["lost", "lost"]


def test_a_fresh_form_says_what_it_needs_and_marks_nothing_before_it_is_submitted(front: Front) -> None:
    page = front.page
    page.open(f"{front.client.base_url}/")
    front.show("schedule")
    front.says("#checked", "Still to fill in: Name, ")
    front.says("#checked", "Specimen")
    marked = "document.querySelectorAll('#schedule-view [aria-invalid=true]').length"
    assert page.evaluate(marked) == 0
    front.click("#submit")
    page.wait_for(f"{marked} > 0")
    assert page.evaluate("document.activeElement.id") == "new-name"
    front.says("#wrong-specimen", "specimen")


def test_a_stored_design_is_chosen_drawn_and_checked(front: Front) -> None:
    sine = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}
    body = {"name": "two sines", "tests": [{"name": "slow", **sine}, {"name": "fast", **sine, "frequency": 8.0}]}
    front.client.post("/v1/designs", json=body).raise_for_status()
    front.page.open(f"{front.client.base_url}/")
    front.show("schedule")
    for key, text in (("rig", "modbus://127.0.0.1:5020"), ("specimen", "damper 7")):
        front.fill(f"#new-{key}", text)
    front.page.wait_for("document.querySelectorAll('#design option').length === 2")
    front.page.evaluate("document.querySelector('#design').selectedIndex = 1")
    front.page.evaluate("document.querySelector('#design').dispatchEvent(new Event('change'))")
    front.says("#plan-said", "2 tests from two sines")
    front.says("#checked", "It fits")
    front.page.wait_for("(document.querySelector('#draw-time').data || [{}])[0].name === 'fast'")
    assert front.page.evaluate("document.querySelector('#new-name').value") == "two sines"


def test_a_test_that_an_explanation_proposes_comes_with_its_rig_and_specimen(front: Front) -> None:
    page = front.page
    page.open(f"{front.client.base_url}/")
    test = {"name": "next", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2}
    of = {"name": "more of it", "rig": "modbus://127.0.0.1:5021", "specimen": "damper 8"}
    page.evaluate(f"import('/static/schedule.js').then(form => form.takeTests([{json.dumps(test)}], {json.dumps(of)}))")
    front.show("schedule")
    front.says("#checked", "It fits")
    for key, text in of.items():
        assert page.evaluate(f"document.querySelector('#new-{key}').value") == text


def test_a_job_whose_answer_was_lost_is_created_once(front: Front, folder: Path) -> None:
    run = (folder / "slow.h5").read_bytes()
    front.client.post("/v1/runs", params={"name": "slow.h5"}, content=run).raise_for_status()
    front.show("runs")
    front.page.wait_for("document.querySelectorAll('#runs-rows tr').length === 1")
    front.click("#runs-rows input")
    front.page.wait_for("document.querySelector('#runs-rows input').checked")
    front.page.evaluate(LOSE)
    front.click("#sheet")
    front.says("#runs-actions + .said", "Press again")
    front.click("#sheet")
    front.says("#runs-actions + .said", "The sheet")
    assert len(front.client.get("/v1/jobs").json()["jobs"]) == 1


def test_a_number_of_days_that_is_none_is_refused_and_makes_no_key_that_never_expires(front: Front) -> None:
    front.show("keys")
    front.page.wait_for("document.querySelectorAll('#keys tr').length === 1")
    front.fill("#key-name", "Ben")
    front.fill("#key-days", "30 days")
    front.click("#make-key")
    front.says("#key-form + .said", "expires_days")
    assert front.names("/v1/keys", "keys") == ["Ada"]


# The check of a campaign is under way until letGo is called; time goes on by window.later milliseconds.
HOLD_CHECK = """(() => {
  const real = window.fetch;
  const clock = performance.now.bind(performance);
  window.later = 0;
  performance.now = () => clock() + window.later;
  window.fetch = async (url, options) => {
    if (String(url).includes("/check")) await new Promise((go, end) => {
      window.letGo = go;
      options.signal.addEventListener("abort", () => end(options.signal.reason));
    });
    return real(url, options);
  };
})()"""
SILENT_MS = "import('/static/feed.js').then(feed => feed.silentMs())"
# Whether the connection is lost; what the stream still said meanwhile is followed by more silence.
LOST = """silent => {
  if (silent < 3000) window.later += 3000;
  return document.querySelector('#link').textContent === 'connection lost';
}"""


def test_a_check_is_waited_for_as_long_as_the_service_is_heard_and_no_longer(front: Front) -> None:
    page = front.page
    page.call("Network.enable")
    front.show("schedule")
    page.evaluate(HOLD_CHECK)
    for key, text in (("rig", "modbus://127.0.0.1:5020"), ("specimen", "damper 7"), ("name", "slow")):
        front.fill(f"#new-{key}", text)
    for _ in range(6):  # 30 s
        page.wait_for("window.letGo !== undefined")
        page.evaluate("window.later += 5000")
        page.wait_for(f"{SILENT_MS}.then(silent => silent < 1000)")
    front.says("#checked", "checking … 3")
    page.evaluate("window.letGo()")
    front.says("#checked", "It fits")
    page.evaluate("window.letGo = undefined")
    front.fill("#new-name", "silent")
    page.wait_for("window.letGo !== undefined")
    page.call("Network.setBlockedURLs", urls=["*/v1/live"])  # its stream is opened again where it was silent
    page.wait_for(f"{SILENT_MS}.then({LOST})")
    page.evaluate("window.later += 15000")
    front.says("#checked", "does not answer")
    page.call("Network.setBlockedURLs", urls=[])
    page.wait_for("document.querySelector('#link').textContent === 'live'")


def test_a_wait_goes_on_where_the_page_goes_elsewhere_while_it_is_asked(front: Front) -> None:
    page, here = front.page, f"{front.client.base_url}/"
    page.open(here)
    page.wait_for("location.search === '?elsewhere' || new Promise(() => { location.search = '?elsewhere'; })")
    assert page.evaluate("location.search") == "?elsewhere"
    page.open(here)
