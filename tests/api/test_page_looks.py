"""How every view looks: text that can be read, words that are whole, names for controls, paper, less motion."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import pytest

from api.campaigns.held_rig import hold_rig
from excitation.files import READABLE
from tests.api.front import Front, at_front
from tests.api.measured import NAMES

pytestmark = pytest.mark.browser

VIEWS = ("live", "schedule", "runs", "keys", "audit")
WIDTHS = (1280, 1101, 901, 360)  # the layout changes at 1100 and 900
LONG = "N" * 200
RIG = "modbus://127.0.0.1:5020"
SINE = {"kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 2, "current": 0.5}
CONTROLS = ("button", "checkbox", "combobox", "link", "searchbox", "textbox")

# The texts on show: their nodes, without those of charts and of what only a screen reader sees.
TEXTS = """
const texts = () => {
  const found = [];
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const node = walk.currentNode;
    const at = node.parentElement;
    const away = at.closest("svg, .unseen, .skip, script, option");
    if (node.data.trim() && at.checkVisibility() && !away) found.push(node);
  }
  return found;
};
"""

# WCAG AA: 4.5, or 3 for text of 24 px, of 18.66 px where it is bold. What is disabled is not read as text.
FAINT = (
    TEXTS
    + """
const parts = (colour) => {
  const found = colour.match(/[\\d.]+/g).map(Number);
  return [...found.slice(0, 3), found[3] ?? 1];
};
const luminance = (rgb) => rgb.map((part) => part / 255)
  .map((part) => part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4)
  .reduce((sum, part, k) => sum + part * [0.2126, 0.7152, 0.0722][k], 0);
const contrastOf = (node, style) => {
  let [behind, opacity] = [null, 1];
  for (let one = node; one; one = one.parentElement) {
    const now = getComputedStyle(one);
    if (!behind && parts(now.backgroundColor)[3] === 1) behind = parts(now.backgroundColor);
    opacity *= Number(now.opacity);
  }
  const ink = parts(style.color).slice(0, 3).map((part, k) => part * opacity + behind[k] * (1 - opacity));
  const [low, high] = [luminance(ink), luminance(behind.slice(0, 3))].sort((a, b) => a - b);
  return (high + 0.05) / (low + 0.05);
};
const needed = (style) => {
  const size = parseFloat(style.fontSize);
  return size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700) ? 3 : 4.5;
};
const faint = [];
const judge = (node, style, words) => {
  const found = contrastOf(node, style);
  if (found < needed(style)) faint.push(`${words.trim().slice(0, 40)}: ${found.toFixed(2)}`);
};
for (const node of texts()) {
  const at = node.parentElement;
  if (!at.closest(":disabled, [aria-disabled='true']")) judge(at, getComputedStyle(at), node.data);
}
for (const field of document.querySelectorAll("[placeholder]")) {
  if (field.checkVisibility()) judge(field, getComputedStyle(field, "::placeholder"), field.placeholder);
}
faint"""
)

# Words of up to 15 letters that stand on two lines (an address may), and text beyond its box or beside the window.
CUT = (
    TEXTS
    + """
const cut = [];
for (const node of texts()) {
  for (const word of node.data.matchAll(/(?<![^\\s(])\\p{L}{2,15}(?![^\\s.,:;?!)])/gu)) {
    const range = document.createRange();
    range.setStart(node, word.index);
    range.setEnd(node, word.index + word[0].length);
    const boxes = [...range.getClientRects()].filter((box) => box.width > 0);
    if (new Set(boxes.map((box) => Math.round(box.top))).size > 1) cut.push("broken: " + word[0]);
    if (boxes.some((box) => box.right > innerWidth + 1)) cut.push("beside the window: " + word[0]);
  }
  const box = node.parentElement;
  const inline = getComputedStyle(box).display === "inline";
  if (!inline && box.scrollWidth > box.clientWidth + 1) cut.push("too long for its box: " + node.data.slice(0, 40));
}
cut"""
)


def within(script: str) -> str:
    *body, result = script.strip().splitlines()
    return "(() => {" + "\n".join(body) + f"\nreturn {result}; }})()"


@pytest.fixture(scope="module")
def front(tmp_path_factory: pytest.TempPathFactory, chromium: Path, folder: Path) -> Iterator[Front]:
    """A campaign that asks, one with long names, one that failed, a paused queue, runs and keys."""
    with at_front(tmp_path_factory.mktemp("looks"), chromium) as front:
        for name, specimen, tests in (
            ("asks", "damper 7", ["first", "second"]),
            (LONG, LONG, [LONG, "short"]),
            ("ended", "damper 7", ["one", "two"]),
        ):
            body = {"name": name, "specimen": specimen, "rig": RIG, "tests": [{**SINE, "name": one} for one in tests]}
            front.client.post("/v1/campaigns", json=body).raise_for_status()
        sent = {one["name"]: one["id"] for one in front.client.get("/v1/campaigns").json()["campaigns"]}
        front.client.post(f"/v1/campaigns/{sent['ended']}/abort").raise_for_status()
        held = hold_rig(front.database, RIG, "test", 600.0)
        assert held is not None
        campaign = held.take_next()
        assert campaign is not None
        held.ask(campaign, "Is the clevis fitted?")
        [rig] = front.client.get("/v1/rigs").json()["rigs"]
        limits = {"interlocks": ["force:-8e3:8e3:stop:0.01", "temperature:-inf:90:stop"]}
        front.client.patch(f"/v1/rigs/{rig['id']}", json=limits).raise_for_status()
        front.client.post(f"/v1/rigs/{rig['id']}/pause", json={"reason": "a leak at the seal"}).raise_for_status()
        for name in NAMES[:2]:
            run = (folder / name).read_bytes()
            front.client.post("/v1/runs", params={"name": name}, content=run).raise_for_status()
        for name, scope in (("K" * 100, "schedule"), ("Ben", "operate")):
            front.client.post("/v1/keys", json={"name": name, "scope": scope, "expires_days": 30}).raise_for_status()
        front.page.evaluate("document.querySelectorAll('details').forEach(node => { node.open = true; })")
        yield front


def set_media(front: Front, *, media: str = "screen", **features: str) -> None:
    told = [{"name": name.replace("_", "-"), "value": value} for name, value in features.items()]
    front.page.call("Emulation.setEmulatedMedia", media=media, features=told)


def set_width(front: Front, width: int) -> None:
    front.page.call("Emulation.setDeviceMetricsOverride", width=width, height=800, deviceScaleFactor=1, mobile=False)


def show_ready(front: Front, view: str) -> None:
    rows = {"live": "#campaigns li", "schedule": "fieldset.test", "runs": "#runs-rows tr", "keys": "#keys tr"}
    front.show(view)
    front.page.wait_for(f"document.querySelector({rows.get(view, '#audit tr')!r}) !== null")


def choose(front: Front, campaign: str) -> None:
    front.page.evaluate(
        "[...document.querySelectorAll('#campaigns button')]"
        f".find(node => node.textContent.startsWith({campaign!r})).click()"
    )
    front.says("#name", campaign)


def test_every_text_stands_out_from_what_is_behind_it(front: Front) -> None:
    found: dict[Any, list[str]] = {}
    for scheme in ("light", "dark"):
        set_media(front, prefers_color_scheme=scheme)
        for view in VIEWS:
            show_ready(front, view)
            found[scheme, view] = front.page.evaluate(within(FAINT))
        show_ready(front, "live")
        front.page.evaluate("document.body.className = 'lost'")  # as where the service is away
        found[scheme, "lost"] = front.page.evaluate(within(FAINT))
        front.page.evaluate("document.body.className = ''")
    set_media(front)
    assert {key: value for key, value in found.items() if value} == {}


def test_no_word_is_broken_and_no_text_is_cut_in_any_window(front: Front) -> None:
    found: dict[Any, list[str]] = {}
    for width, view in product(WIDTHS, VIEWS):
        set_width(front, width)
        show_ready(front, view)
        found[width, view] = front.page.evaluate(within(CUT))
        if not front.page.evaluate("document.documentElement.scrollWidth <= innerWidth"):
            found[width, view].append("the window scrolls sideways")
    for width, campaign in product(WIDTHS, ("asks", LONG, "ended")):
        set_width(front, width)
        show_ready(front, "live")
        choose(front, campaign)
        found[width, campaign[:10]] = front.page.evaluate(within(CUT))
    set_width(front, 1280)
    assert {key: value for key, value in found.items() if value} == {}


def test_readings_of_a_large_rig_fit_their_tiles(front: Front) -> None:
    show_ready(front, "live")
    largest = {
        "force": "−25.00 kN",
        "degrees": "120.5 °C",
        "left": "167 h 59 min",
        "place": "−125.0 mm",
        "fifo": "100 %",
    }
    for width in WIDTHS:
        set_width(front, width)
        for key, text in largest.items():
            wide = front.page.evaluate(
                f"(node => {{ node.textContent = {text!r}; return node.scrollWidth - node.clientWidth; }})"
                f"(document.querySelector('#cell-{key}'))"
            )
            assert wide <= 1, (width, key)
    set_width(front, 1280)


def test_interlocks_are_said_with_their_units(front: Front) -> None:
    show_ready(front, "live")
    front.says("#rigs .about", "force from −8000 N to 8000 N, else stop after 0.01 s")
    front.says("#rigs .about", "temperature to 90 °C, else stop")


def test_the_orders_stay_where_they_are_however_long_the_text_beside_them(front: Front) -> None:
    show_ready(front, "live")
    place = "(box => [box.right, box.top])(document.querySelector('#safe').getBoundingClientRect())"
    before = front.page.evaluate(place)
    front.page.evaluate(f"document.querySelector('#cell-text').textContent = {'a reason ' * 30!r}")
    assert front.page.evaluate(place) == before


def test_every_control_has_a_name(front: Front) -> None:
    front.page.call("Accessibility.enable")
    for view in VIEWS:
        show_ready(front, view)
        tree = front.page.call("Accessibility.getFullAXTree")["nodes"]
        shown = [node for node in tree if not node["ignored"] and node["role"]["value"] in CONTROLS]
        assert len(shown) >= 6
        assert [node for node in shown if not node["name"]["value"].strip()] == [], view
    front.page.call("Accessibility.disable")


def test_on_paper_are_the_rigs_and_results_in_dark_ink_and_no_controls(front: Front) -> None:
    show_ready(front, "live")
    choose(front, "asks")
    for scheme in ("light", "dark"):
        set_media(front, media="print", prefers_color_scheme=scheme)
        shown = (
            "[...document.querySelectorAll('button, input, select, nav, form')].filter(node => node.checkVisibility())"
        )
        assert (
            front.page.evaluate(f"{shown}.filter(node => !node.matches('.choose, .plain')).map(node => node.outerHTML)")
            == []
        )
        for selector in ("#cell", "#rigs .name", "#rigs .queue", "#campaigns .name", "#tests", "#rigs .about"):
            assert front.page.evaluate(f"document.querySelector({selector!r}).checkVisibility()"), selector
        assert front.page.evaluate(within(FAINT)) == []
        assert front.page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
        behind = "[...document.querySelectorAll('.state')].map(node => getComputedStyle(node).backgroundColor)"
        assert set(front.page.evaluate(behind)) == {"rgba(0, 0, 0, 0)"}
    set_media(front)


def test_lines_of_a_chart_differ_in_their_pattern_too_and_their_swatches_show_it(front: Front) -> None:
    show_ready(front, "live")
    front.page.evaluate("import('/static/charts.js').then(charts => { window.charts = charts; })")
    lines = front.page.evaluate("[...Array(40).keys()].map(k => window.charts.lineOf(k, 1.5))")
    for five in zip(*(lines[k:] for k in range(5)), strict=False):
        assert len({line["dash"] for line in five}) == 5
    assert len({(line["dash"], line["color"]) for line in lines}) == 40
    for place, line in enumerate(lines):
        swatch = front.page.evaluate(f"window.charts.swatchOf({place})")
        lengths = [float(px) for px in line["dash"].replace("solid", "1,0").replace("px", "").split(",")]
        edges = [sum(lengths[:k]) for k in range(len(lengths) + 1)]
        assert [float(px) for px in re.findall(r"([\d.]+)px", swatch)] == [e for two in pairwise(edges) for e in two]


def test_the_form_offers_every_kind_of_file_that_can_be_scheduled(front: Front) -> None:
    assert set(front.page.evaluate("document.querySelector('#plan').accept.split(',')")) == {
        ".toml",
        ".json",
        *READABLE,
    }


def test_the_description_of_the_interface_can_be_read_in_light_and_dark(front: Front) -> None:
    front.page.open(f"{front.client.base_url}/docs", width=360)
    for scheme, light in (("light", True), ("dark", False)):
        set_media(front, prefers_color_scheme=scheme)
        assert front.page.evaluate(within(FAINT)) == []
        paper = front.page.evaluate("getComputedStyle(document.body).backgroundColor")
        assert (paper == "rgb(255, 255, 255)") is light
    assert front.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    set_media(front)
    front.page.open(f"{front.client.base_url}/")
    front.says("#link", "live")


def test_a_campaign_without_samples_has_no_empty_charts(front: Front) -> None:
    show_ready(front, "live")
    choose(front, "asks")
    assert front.page.evaluate("document.querySelector('#no-loops').checkVisibility()")
    assert not front.page.evaluate("document.querySelector('#fx').checkVisibility()")
