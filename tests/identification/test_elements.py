"""Elements: whatever is peculiar to one stands in its row, and two of a kind can be told apart."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import identification
from identification.discrepancy.candidates import admissible, guesses
from identification.errors import ModelError
from identification.fitting.leastsquares import fit_records
from identification.physical.elements import CATALOGUE, SHIFT, Curve, ElementSpec, Family, codes_of
from identification.physical.model import Element, Model, Parameter, element, name_of
from identification.physical.modelfile import model_from_json, model_to_json, read_model, write_model
from identification.physical.simulate import simulate
from identification.scales import scales_of
from tests.identification.motions import motion
from tests.identification.specimens import AS_SIMULATED, records_with

ROOT = Path(identification.__file__).parent
NAME = re.compile(rf"\b({'|'.join(CATALOGUE)})\b")


def said_in(source: str) -> Iterator[str]:
    """Element names in the string literals of a module, docstrings left out."""
    tree = ast.parse(source)
    prose = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
            yield from NAME.findall(node.value)


def test_no_module_outside_of_the_elements_folder_names_an_element() -> None:
    modules = {path.relative_to(ROOT).as_posix(): path for path in ROOT.rglob("*.py")}
    outside = {name: path for name, path in modules.items() if not name.startswith("physical/elements/")}
    naming = {name: sorted(set(said_in(path.read_text(encoding="utf-8")))) for name, path in outside.items()}
    assert {name: said for name, said in naming.items() if said} == {}


@pytest.mark.parametrize("said", ['x = "end_stop"', 'x = f"{y}: gas_spring"', "x = {'mains_hum.phase': 1}"])
def test_a_module_that_names_an_element_is_found_out(said: str) -> None:
    assert list(said_in(said))


@pytest.mark.parametrize("said", ['"""Of an end_stop."""', "x = 'a gas spring'", "class A:\n    '''end_stop'''"])
def test_words_for_a_reader_name_no_element(said: str) -> None:
    assert not list(said_in(said))


@pytest.mark.parametrize("spec", CATALOGUE.values(), ids=lambda spec: spec.name)
def test_what_a_row_says_of_other_rows_and_of_the_data_holds_together(spec: ElementSpec) -> None:
    assert spec.departure is None or set(spec.departure.of) <= set(CATALOGUE)
    assert spec.growth is None or spec.growth.of in CATALOGUE
    assert not spec.falls_with_speed or spec.dry_friction
    assert spec.curve is None or spec.path == "core"
    scales = scales_of(records_with("none")[:1], gap=10.0)
    for p in spec.parameters:
        if p.limits is not None:
            low, high = p.limits(scales)
            assert p.low <= low < high
    for guess in guesses(spec.name, scales):
        beside = [CATALOGUE[name] for name in ("coulomb_friction", "relief_valve")]
        assert spec.denied is None or not spec.denied(guess.values(), beside)
        own = zip(spec.parameters, guess.parameters, strict=True)
        assert all(p.fixed for s, p in own if s.held or s.constant is not None)


def test_every_code_tells_the_family_and_the_element() -> None:
    codes = codes_of(list(CATALOGUE.values()))
    assert len(set(codes.values())) == len(CATALOGUE)
    assert all(code >> SHIFT == CATALOGUE[name].family for name, code in codes.items())


def test_one_element_more_than_a_family_has_room_for_is_refused_in_one_line() -> None:
    rows = [replace(CATALOGUE["gas_spring"], name=f"spring {k}") for k in range(2**SHIFT + 1)]
    assert codes_of(rows[:-1])["spring 31"] == Family.SPRING << SHIFT | 31
    with pytest.raises(ModelError, match=r"spring 32: the family SPRING has room for 32 elements") as refused:
        codes_of(rows)
    assert "\n" not in str(refused.value)


def test_whole_curves_carry_a_model_and_bends_do_not() -> None:
    assert all(spec.carries for spec in CATALOGUE.values() if spec.curve == Curve.WHOLE)
    assert not CATALOGUE["relief_valve"].carries
    assert CATALOGUE["viscous_damping"].carries
    assert not CATALOGUE["viscous_damping"].bent


def two_dampers(**second: str) -> Model:
    """Two of a kind: 700 N·s/m of the base and 300 N·s/m more."""
    slope = element("viscous_damping", {"c": 700.0})
    return Model(name="m", elements=(slope, Element("viscous_damping", element(
        "viscous_damping", {"c": 300.0}, fixed=("c",)).parameters, **second)))  # fmt: skip


def test_two_of_a_kind_are_numbered_in_order() -> None:
    model = two_dampers().with_element(element("viscous_damping", {"c": 1.0}))
    assert model.ids == ("viscous_damping", "viscous_damping#2", "viscous_damping#3")
    assert {name_of(i) for i in model.ids} == {"viscous_damping"}
    assert model.names()[::2] == ["viscous_damping.c", "viscous_damping#2.c", "viscous_damping#3.c"]


def test_a_mass_that_is_added_to_a_late_recorder_is_late_too() -> None:
    """A delay acts on all that the load cell feels; the order of what is there stays as it is."""
    late = Model(name="late", elements=(
        element("viscous_damping", {"c": 1000.0}), element("force_delay", {"tau": 0.02}),
        element("force_offset", {"F0": 7.0}),
    ))  # fmt: skip
    heavy = late.with_element(element("moving_mass", {"m": 5.0}))
    assert heavy.ids == ("viscous_damping", "moving_mass", "force_delay", "force_offset")
    inputs = motion()
    force = simulate(heavy, inputs).force - simulate(late, inputs).force
    assert force[100:-100] == pytest.approx(5.0 * np.interp(inputs.t - 0.02, inputs.t, inputs.a)[100:-100], abs=0.05)


def test_an_element_keeps_its_id_when_another_of_its_kind_goes_or_comes() -> None:
    model = two_dampers()
    second = model.without("viscous_damping")
    assert second.ids == ("viscous_damping#2",)
    assert second.element("viscous_damping#2").value("c") == 300.0
    assert second.with_element(element("viscous_damping", {"c": 1.0})).ids == ("viscous_damping#2", "viscous_damping")
    assert model.without("viscous_damping#2").ids == ("viscous_damping",)
    with pytest.raises(ModelError, match="has no element 'viscous_damping#3': it has viscous_damping, viscous"):
        model.without("viscous_damping#3")


def test_a_label_is_given_once_and_begins_with_the_name() -> None:
    slope = element("viscous_damping", {"c": 700.0})
    named = Element("viscous_damping", slope.parameters, "viscous_damping#rebound")
    assert Model(name="m", elements=(named, slope, slope)).ids[0] == "viscous_damping#rebound"
    with pytest.raises(ModelError, match="'viscous_damping#rebound' is given more than once"):
        Model(name="m", elements=(named, named))
    for wrong in ("rebound", "viscous_damping#", "viscous_damping#a.c", "viscous_damping2", "end_stop#1"):
        with pytest.raises(ModelError, match="is none of a 'viscous_damping'"):
            Element("viscous_damping", (Parameter(value=1.0), Parameter(value=0.0)), wrong)


def test_a_fit_moves_the_one_that_is_free_and_keeps_both_ids() -> None:
    records = records_with("none")[:2]
    rest = AS_SIMULATED.elements
    model = Model(name="m", elements=(*rest, *two_dampers().elements))
    fitted = fit_records(model, records, max_iterations=3).model
    assert fitted.ids == model.ids
    assert fitted.element("viscous_damping").value("c") != 700.0
    assert fitted.element("viscous_damping#2").value("c") == 300.0


@pytest.mark.parametrize("label", ["", "viscous_damping#2", "viscous_damping#rebound"])
def test_two_of_a_kind_survive_the_file(label: str, tmp_path: Path) -> None:
    model = two_dampers(id=label)
    for kept in (model, model.without("viscous_damping"), model.without(model.ids[1])):
        write_model(tmp_path / "model.json", kept)
        assert read_model(tmp_path / "model.json") == kept


def test_an_id_is_written_only_where_the_order_does_not_give_it() -> None:
    core = model_to_json(two_dampers())["paths"]["core"]
    assert [set(item) for item in core] == [{"element", "parameters"}] * 2
    core = model_to_json(two_dampers().without("viscous_damping"))["paths"]["core"]
    assert [item.get("id") for item in core] == ["viscous_damping#2"]


def test_ids_that_only_look_as_if_in_order_are_written() -> None:
    c, d = (element("viscous_damping", {"c": c}) for c in (1.0, 2.0))
    third, second = (Element(e.name, e.parameters, f"{e.name}#{k}") for e, k in ((c, 3), (d, 2)))
    model = Model(name="m", elements=(third, second))
    assert model_from_json(model_to_json(model)) == model


@pytest.mark.parametrize("wrong", [7, "", "end_stop"])
def test_a_file_with_a_wrong_id_is_refused_in_one_line(wrong: object) -> None:
    data = model_to_json(two_dampers())
    data["paths"]["core"][1]["id"] = wrong
    with pytest.raises(ModelError, match=r"paths.core\[1\]") as caught:
        model_from_json(data)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("gap", "air"), [(0.0, True), (1e-3, False)])
def test_beside_a_play_no_free_air_is_named_and_an_idle_play_hides_none(gap: float, air: bool) -> None:
    records = records_with("none")[:1]
    joint = element("free_play", {"gap": gap}, fixed=("gap",))
    model = Model(name="m", elements=(element("viscous_damping", {"c": 900.0}), joint))
    names = admissible(model, records, scales_of(records, gap=10.0))
    assert ("aerated_oil" in names) is air
    assert "free_play" not in names  # a model holds one


def test_beside_an_idle_one_another_of_its_kind_may_be_named_and_has_an_id_of_its_own() -> None:
    records = records_with("none")[:1]
    idle = Model(name="m", elements=(element("viscous_damping", {"c": 0.0}, fixed=("c",)),))
    scales = scales_of(records, gap=10.0)
    assert "viscous_damping" in admissible(idle, records, scales)
    guess = idle.numbered(guesses("viscous_damping", scales)[0])
    assert guess.id == "viscous_damping#2"
    assert idle.with_element(guess).elements[-1] is guess
    assert np.array_equal(idle.with_element(guess).without(guess.id).values(), idle.values())
