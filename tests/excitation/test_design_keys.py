"""What is told of the keys of a design is what its reader takes."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from excitation.configuration import to_spec
from excitation.design_keys import COMMANDS, Key, keys_of, keys_text
from excitation.errors import DesignError
from excitation.multisine_spec import MultisineSpec
from excitation.plan_steps import STEPS, steps_from_config

EXAMPLES = Path(__file__).parents[2] / "examples"
DESIGNS = {
    "random-phase": ("random_phase", "low_crest"),
    "homogenised": ("homogenised", "homogenised_levels", "homogenised_passive"),
    "harmonic": ("first_sines", "mr_seat_damper_matrix", "pvp_and_cvp", "yaw_damper_30_tests"),
}


def used_in(table: object, place: str = "") -> set[tuple[str, str]]:
    """Table and name of every key of a configuration."""
    if isinstance(table, list):
        return {found for one in table for found in used_in(one, place)}
    if not isinstance(table, dict):
        return set()
    return {(place, name) for name in table} | {
        found for name, value in table.items() for found in used_in(value, f"{place}.{name}".lstrip("."))
    }


@pytest.mark.parametrize(("command", "name"), [(c, name) for c, names in DESIGNS.items() for name in names])
def test_every_key_of_the_examples_is_told(command: str, name: str) -> None:
    told = {(key.place, key.name) for key in keys_of(command)}
    axes = {"series.amplitude", "series.frequency", "series.peak_velocity", "series.current"}  # ranges stand with them
    used = used_in(tomllib.loads((EXAMPLES / f"{name}.toml").read_text(encoding="utf-8")))
    assert {one for one in used if one[0] not in axes} <= told


@pytest.mark.parametrize("command", COMMANDS)
def test_every_key_has_a_meaning_and_a_line(command: str) -> None:
    text = keys_text(command)
    assert all(key.meaning and str(key) in text for key in keys_of(command))


@pytest.mark.parametrize("step", STEPS)
def test_the_keys_of_each_step_before_a_test_are_told_and_taken(step: str) -> None:
    place = f'before, step = "{step}"'
    told = [key for key in keys_of("conditions") if key.place == place]
    assert f"[{place}]" in keys_text("conditions")
    text = {"text": "bleed it", "of": "oil"}
    table = {"step": step} | {key.name: text.get(key.name, 30) for key in told}
    if "min" in table:
        table["max"] = 60
    assert steps_from_config([table], "before")
    with pytest.raises(DesignError, match="speed"):
        steps_from_config([{**table, "speed": 1}], "before")


def test_a_required_key_is_missed_by_the_reader_and_an_optional_one_is_not() -> None:
    whole = {"sample_rate": 1000.0, "period_samples": 1000,
             "displacement": {"f_min": 1.0, "f_max": 20.0, "max_displacement": 0.01, "max_velocity": 0.3}}  # fmt: skip
    assert to_spec(MultisineSpec, whole).seed == 0
    required = [
        key for key in keys_of("random-phase") if key.default == "required" and key.place in ("", "displacement")
    ]
    assert len(required) == 7
    for key in required:
        with pytest.raises(DesignError, match=f"{key.name} is missing"):
            to_spec(MultisineSpec, without(whole, key))


def without(config: dict[str, object], key: Key) -> dict[str, object]:
    inner = config["displacement"]
    assert isinstance(inner, dict)
    if key.place:
        return {**config, key.place: {name: value for name, value in inner.items() if name != key.name}}
    return {name: value for name, value in config.items() if name != key.name}


def test_units_are_those_of_the_messages() -> None:
    units = {(key.place, key.name): key.unit for key in keys_of("random-phase")}
    assert units["displacement.quarter_car", "spring_rate"] == "N/m"
    assert units["displacement", "max_velocity"] == "m/s"
