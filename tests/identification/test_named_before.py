"""A model that a search has added names to, as the base of the next one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from identification.discrepancy import Explanation, explain, write_report
from identification.discrepancy.explanation import Verdict
from identification.errors import ModelError
from identification.physical.model import Model
from identification.physical.modelfile import model_from_json, model_to_json, read_model, write_model
from rigctl.runfile import Run, with_channel
from tests.identification.specimens import AS_SIMULATED, run

FITTED, HELD = (0, 2, 4), (1, 3)


def runs(numbers: tuple[int, ...], stiffness: float = 0.0) -> list[Run]:
    """Runs of a damper with two frictions, of which no one element has the form, and perhaps a spring."""
    made = [run("two_frictions", k, 3) for k in numbers]
    return [with_channel(r, "force", r.channels["force"] + stiffness * r.channels["displacement"], "N") for r in made]


@cache
def explained() -> Explanation:
    return explain(AS_SIMULATED, runs(FITTED), runs(HELD))


@pytest.mark.slow
def test_what_the_form_of_a_name_leaves_is_no_further_discrepancy_of_the_model_with_that_name(
    tmp_path: Path,
) -> None:
    found = explained()
    assert found.verdict is Verdict.EXPLAINED
    (named,) = (e for e in found.model.elements if e.named)
    assert [e.element for e in found.effects] == [named.name]
    again = explain(found.model, runs(FITTED), runs(HELD))
    assert again.verdict is Verdict.NO_DISCREPANCY
    assert "within the tolerance of the canonical forms" in again.remainder
    page = write_report(again, tmp_path).read_text(encoding="utf-8")
    assert "an earlier search has named" in page
    assert "down to the noise" not in page
    of_nobody = Model(name="plain", elements=tuple(replace(e, named=False) for e in found.model.elements))
    assert explain(of_nobody, runs(FITTED), runs(HELD)).verdict is Verdict.UNKNOWN_EFFECT


@pytest.mark.slow
def test_an_effect_that_is_new_is_found_beside_a_name_of_an_earlier_search() -> None:
    found = explain(explained().model, runs(FITTED, 2500.0), runs(HELD, 2500.0))
    assert [e.element for e in found.effects] == ["linear_stiffness"]
    assert found.effects[0].parameters["k"][0] == pytest.approx(2500.0, rel=0.1)
    assert sum(e.named for e in found.model.elements) == 2


def test_a_model_file_keeps_which_elements_a_search_has_named(tmp_path: Path) -> None:
    model = explained().model
    write_model(tmp_path / "model.json", model)
    assert read_model(tmp_path / "model.json") == replace(model)
    plain = model_to_json(AS_SIMULATED)
    assert all("named" not in e for path in plain["paths"].values() for e in path)
    assert model_from_json(plain) == AS_SIMULATED


@pytest.mark.parametrize("value", [1, "yes", None, []])
def test_a_mark_that_is_neither_true_nor_false_is_refused_with_its_place(value: Any) -> None:  # Any: parsed JSON
    plain = model_to_json(AS_SIMULATED)
    plain["paths"]["core"][0]["named"] = value
    with pytest.raises(ModelError, match=r"^paths\.core\[0\]\.named is .*: it must be true or false$"):
        model_from_json(plain)
