"""The model file: what is written reads back, and what is wrong is refused in one line."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from identification.errors import ModelError
from identification.physical.elements import CATALOGUE, ElementSpec
from identification.physical.model import Model, element
from identification.physical.modelfile import model_from_json, model_to_json, read_model, write_model


def good() -> dict[str, Any]:
    return {
        "format": "damper-rig/model",
        "format_version": 1,
        "name": "damper",
        "kind": "physical",
        "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 1000.0}}]},
    }


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_element_survives_the_file(name: str, tmp_path: Path) -> None:
    spec = CATALOGUE[name]
    values = {p.name: min(1.5, p.high) for p in spec.parameters if p.constant is None and not p.refinement}
    elements = [element(name, values)]
    if spec.path != "core":
        elements.append(element("viscous_damping", {"c": 1.0}))
    model = Model(name="m", elements=tuple(elements))
    write_model(tmp_path / "model.json", model)
    assert read_model(tmp_path / "model.json") == model


def test_a_neutral_refinement_is_not_written() -> None:
    data = model_to_json(Model(name="m", elements=(element("coulomb_friction", {"f_c": 5.0}),)))
    assert data["paths"]["core"][0]["parameters"] == {"f_c": 5.0}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d.update(format="x"), "format is 'x'"),
        (lambda d: d.update(format_version=2), "format_version is 2"),
        (lambda d: d.update(kind="narx"), "kind is 'narx'"),
        (lambda d: d["paths"].update(engine=[]), "paths.engine is no path"),
        (lambda d: d["paths"].update(core=[]), "core is empty"),
        (lambda d: d["paths"]["core"].append({"element": "flux"}), "'flux' is not in the catalogue"),
        (
            lambda d: d["paths"]["core"].append({"element": "force_offset", "parameters": {"F0": 1}}),
            "belongs to sensor",
        ),
        (lambda d: d["paths"]["core"][0]["parameters"].update(c=-1), "physically it lies within"),
        (lambda d: d["paths"]["core"][0]["parameters"].update(c="a"), "must be a number"),
        (lambda d: d["paths"]["core"][0]["parameters"].update(c=float("nan")), "must be a finite number"),
        (lambda d: d["paths"]["core"][0]["parameters"].update(k=1), "no parameter 'k'"),
        (lambda d: d["paths"]["core"][0].update(parameters={}), "lacks its parameter 'c'"),
    ],
)
def test_a_wrong_model_is_refused_in_one_line(change: Any, words: str) -> None:
    data = good()
    change(data)
    with pytest.raises(ModelError, match=words) as caught:
        model_from_json(data)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_no_json_names_the_place(tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    path.write_text(json.dumps(good())[:-5], encoding="utf-8")
    with pytest.raises(ModelError, match=r"model.json: line 1, column \d+: no JSON"):
        read_model(path)


@pytest.mark.parametrize("spec", CATALOGUE.values(), ids=lambda spec: spec.name)
def test_the_equation_of_an_element_contains_each_of_its_parameters(spec: ElementSpec) -> None:
    words = set(re.findall(r"\w+", spec.equation.replace("²", " ").replace("³", " ")))
    assert {p.name for p in spec.parameters if not p.refinement} <= words
