"""A rig and its queue by keyboard alone: every order can be reached and given, and the focus is never lost."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from api.campaigns.held_rig import HeldRig, hold_rig
from api.campaigns.orders import Asked
from api.campaigns.records import Campaign, CampaignState
from api.campaigns.store import CampaignStore
from tests.api.front import Front, at_front

pytestmark = [pytest.mark.browser, pytest.mark.slow]

RIG = "modbus://127.0.0.1:1"  # nobody is there: the orders are asked for, and this test is the worker that obeys
SINE = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}
QUESTION = "Is the clevis fitted?"
WAITING = 22  # more than the stream tells
FOCUS = "(node => node && (node.getAttribute('aria-label') || node.textContent).trim())(document.activeElement)"


@dataclass(frozen=True, kw_only=True)
class Keyboard:
    """A person without a mouse, and the worker of the rig."""

    front: Front
    held: HeldRig
    running: Campaign

    def go_to(self, name: str, within: str = "body") -> None:
        """Press Tab until a control with this name has the focus."""
        page = self.front.page
        here = f"{FOCUS} === {name!r} && document.activeElement.closest({within!r}) !== null"
        for _ in range(400):
            page.press("Tab")
            if page.evaluate(here):
                return
        raise AssertionError(f"Tab does not reach {name!r}")

    def press(self, name: str, within: str = "body", key: str = "Enter") -> None:
        self.go_to(name, within)
        self.front.page.press(key)

    def focus_is_in(self, selector: str) -> None:
        self.front.page.wait_for(f"document.activeElement.closest({selector!r}) !== null")

    def queue(self) -> list[str]:
        names: list[str] = self.front.page.evaluate(
            "[...document.querySelectorAll('.queue .plain')].map(node => node.textContent)"
        )
        return names

    def sees(self, expression: str) -> None:
        self.front.page.wait_for(f"Boolean({expression})")

    def answer(self) -> str:
        ends = time.monotonic() + 60.0
        while (answer := self.held.answer(self.running)) is None:  # the page has sent it by now
            assert time.monotonic() < ends
            time.sleep(0.02)
        return answer

    def asked(self) -> Asked:
        return CampaignStore(self.front.database).campaign(self.running.id).asked


def submit(front: Front, name: str) -> None:
    body = {"name": name, "specimen": "damper 7", "rig": RIG, "tests": [{**SINE, "name": "first"}]}
    front.client.post("/v1/campaigns", json=body).raise_for_status()


@pytest.fixture(scope="module")
def keyboard(tmp_path_factory: pytest.TempPathFactory, chromium: Path) -> Iterator[Keyboard]:
    with at_front(tmp_path_factory.mktemp("keyboard"), chromium) as front:
        submit(front, "runs")
        held = hold_rig(front.database, RIG, "test", 600.0)
        assert held is not None
        running = held.take_next()
        assert running is not None
        for number in range(WAITING):
            submit(front, f"waits {number}")
        front.page.wait_for(f"document.querySelectorAll('.queue li').length === {WAITING}")
        yield Keyboard(front=front, held=held, running=running)


def test_a_long_queue_is_shown_by_names_in_its_order(keyboard: Keyboard) -> None:
    keyboard.sees("[...document.querySelectorAll('.queue .plain')].every(node => node.textContent.startsWith('waits'))")
    assert keyboard.queue() == [f"waits {number}" for number in range(WAITING)]
    keyboard.sees(f"document.querySelectorAll('#campaigns li').length === {WAITING + 1}")


def test_a_campaign_is_moved_and_deleted_by_keyboard(keyboard: Keyboard) -> None:
    page = keyboard.front.page
    keyboard.press("Later", ".queue", " ")
    keyboard.sees("document.querySelectorAll('.queue .plain')[1].textContent === 'waits 0'")
    assert page.evaluate("document.activeElement === document.querySelectorAll('.queue [aria-label=Later]')[1]")
    page.press("Enter")
    keyboard.sees("document.querySelectorAll('.queue .plain')[2].textContent === 'waits 0'")
    assert page.evaluate("document.activeElement === document.querySelectorAll('.queue [aria-label=Later]')[2]")
    keyboard.press("Delete this campaign from the queue", ".queue")
    keyboard.sees(f"document.querySelectorAll('.queue li').length === {WAITING - 1}")
    assert "waits 0" not in keyboard.queue()
    assert page.evaluate("document.activeElement === document.querySelectorAll('.queue li')[2]")  # the one after it


def test_the_queue_is_paused_and_resumed_by_keyboard(keyboard: Keyboard) -> None:
    page = keyboard.front.page
    keyboard.go_to("Why the queue pauses")
    page.call("Input.insertText", text="a leak")
    keyboard.press("Pause queue")
    keyboard.sees("document.querySelector('#rigs .reason').textContent === 'a leak'")
    keyboard.focus_is_in(".rig")
    assert page.evaluate("document.activeElement.matches('button')") is False  # a second Enter resumes nothing
    keyboard.press("Resume queue")
    keyboard.sees("document.querySelector('#rigs .reason').hidden")
    keyboard.focus_is_in(".rig")


def test_a_question_is_seen_beside_the_rig_and_answered_by_keyboard(keyboard: Keyboard) -> None:
    keyboard.held.ask(keyboard.running, QUESTION)
    keyboard.sees("document.querySelector('#cell-campaign-state').textContent === 'asks its operator'")
    keyboard.sees("document.querySelector('#campaigns').textContent.includes('asks its operator')")
    keyboard.sees(f"document.querySelector('#told').textContent.includes({QUESTION!r})")  # a screen reader says it
    keyboard.sees("!document.querySelector('#question .go').disabled")
    keyboard.press("Confirm", "#question")
    keyboard.sees("document.querySelector('#question').hidden")
    keyboard.focus_is_in("#one")
    assert keyboard.answer() == "yes"
    keyboard.held.close_question(keyboard.running)


def test_hold_resume_stop_and_make_safe_by_keyboard(keyboard: Keyboard) -> None:
    page = keyboard.front.page
    keyboard.press("Hold")
    keyboard.sees("!document.querySelector('#resume').hidden")
    keyboard.focus_is_in(".orders")
    assert keyboard.asked() is Asked.HOLD
    page.press("Enter")  # once more: nothing moves on
    keyboard.press("Resume", "#cell")
    keyboard.sees("!document.querySelector('#hold').hidden")
    assert keyboard.asked() is Asked.NOTHING
    keyboard.press("Make safe", "#cell")
    keyboard.sees("/Make safe.*press the emergency stop/.test(document.querySelector('#cell .said').textContent)")
    keyboard.focus_is_in("#safe")
    keyboard.press("Stop", "#cell")
    keyboard.sees("document.querySelector('#cell .said').textContent.startsWith('Stop: taken')")
    assert keyboard.asked() is Asked.STOP
    keyboard.held.end(keyboard.running, CampaignState.ABORTED, "stopped by somebody", pauses=True)
    keyboard.sees("document.querySelector('#stop').hidden")
    keyboard.focus_is_in("#cell .orders")


def test_a_campaign_that_ends_behind_many_newer_ones_stays_on_show_and_is_repeated(keyboard: Keyboard) -> None:
    keyboard.sees("document.querySelector('#name').textContent === 'runs'")
    keyboard.sees("document.querySelector('#state').textContent === 'aborted'")
    keyboard.press("Repeat")
    keyboard.sees(f"document.querySelectorAll('.queue li').length === {WAITING}")
    keyboard.focus_is_in("#retry")


def test_the_first_link_leads_to_the_view_that_is_shown(keyboard: Keyboard) -> None:
    keyboard.front.show("runs")
    keyboard.press("To the content")
    keyboard.focus_is_in("#runs-view")
    keyboard.front.show("live")
