"""Machines of the second generator are physical, reproducible, and sized as they say."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.machines import KINDS, Case, case, write_case
from benchmarks.machines.__main__ import main
from benchmarks.machines.bases import BaseElement, Seen, model_file
from benchmarks.machines.case import LEAST_NOISE
from benchmarks.machines.effect import Scale
from benchmarks.machines.figures import exact, group, right_names, summary, wrong_names
from benchmarks.machines.injection import injected
from benchmarks.machines.judge import Outcome, question_of
from benchmarks.machines.kinds import Machine
from benchmarks.machines.measured import MeasuredSet, measured_sets, noise_of
from benchmarks.machines.motions import moved_by, plans_of, rate_for, steps_for
from benchmarks.machines.recording import CHAIN_NAMES, Chain, Luck, sensed
from benchmarks.machines.simulation import Motion, force_of, motion_under
from benchmarks.machines.textbook import ADDED, Setting
from benchmarks.machines.variants import VARIANTS, variant
from identification.physical.elements import CATALOGUE
from identification.physical.modelfile import model_from_json
from rigctl.runfile import Run, read_run, write_run

PASSIVE = ("mono_tube", "twin_tube", "magnetic", "yaw", "bush", "pneumatic_cylinder", "hydraulic_cylinder", "rack")


@cache
def made(seed: int) -> Case:
    return case(seed)


def drawn(kind: str, seed: int) -> tuple[Machine, Motion, Scale, np.random.Generator]:
    """A machine of a kind without effects in one random motion, in half the steps of a case."""
    rng = np.random.default_rng([7, seed])
    machine = KINDS[kind](rng)
    plan = replace(plans_of(rng, machine.envelope, "road", 1)[0], seconds=4.0, rest_s=0.3, fade_s=0.5)
    rate = rate_for(rng, machine.envelope)
    motion = moved_by(plan, rate, 2 * steps_for(rate))
    if machine.envelope.driven:
        motion = motion_under(machine.values, motion.x, motion)
    force = force_of(machine.values, motion)
    peak = float(np.max(np.abs(force)))
    top = machine.envelope.current_a[1] if machine.envelope.current_a else 0.0
    scale = Scale(
        force_n=float(np.std(force)), peak_n=peak, stroke_m=float(np.max(np.abs(motion.x))),
        speed_m_s=float(np.max(np.abs(motion.v))), current_a=top, seconds=4.0, rate_hz=motion.rate_hz,
        fastest_hz=machine.envelope.high_hz,
    )  # fmt: skip
    return machine, motion, scale, rng


def with_effects(
    machine: Machine, scale: Scale, rng: np.random.Generator, outside: bool
) -> dict[str, dict[str, float]]:
    """The numbers of the machine with each of its effects alone; those of the recording chain are left out."""
    out = {}
    for effect in (*machine.effects, *(machine.outside if outside else ())):
        values = effect.draw(rng, scale, machine.values)
        if not set(values) & set(CHAIN_NAMES):
            out[effect.title] = {**machine.values, **values}
    return out


@pytest.mark.parametrize("kind", PASSIVE)
def test_a_passive_machine_takes_up_more_energy_than_it_gives_back(kind: str) -> None:
    machine, motion, scale, rng = drawn(kind, 1)
    for title, values in with_effects(machine, scale, rng, outside=False).items():
        assert abs(motion.x[-1] - motion.x[0]) < 1e-12, "what springs hold is given back"
        assert np.sum(force_of(values, motion) * motion.v) * motion.dt > 0.0, title


@pytest.mark.parametrize("kind", tuple(KINDS))
def test_half_the_step_changes_the_force_by_less_than_the_noise(kind: str) -> None:
    machine, motion, scale, rng = drawn(kind, 2)
    for title, values in with_effects(machine, scale, rng, outside=True).items():
        coarse = Motion(
            x=motion.x[::2], v=motion.v[::2], a=motion.a[::2], current=motion.current, temperature=motion.temperature,
            fine=motion.fine // 2, rate_hz=motion.rate_hz, lead=motion.lead,
        )  # fmt: skip
        finer, force = force_of(values, motion)[::2], force_of(values, coarse)
        size = min(finer.size, force.size)
        changed = float(np.sqrt(np.mean((finer[:size] - force[:size]) ** 2)))
        assert changed < LEAST_NOISE * scale.force_n, title


def test_a_mass_that_a_force_drives_answers_with_that_force() -> None:
    machine, motion, _, _ = drawn("oscillator", 3)
    drive = 2.0 * np.sin(2.0 * np.pi * 2.0 * np.arange(motion.x.size) * motion.dt)
    moved = motion_under(machine.values, drive, motion)
    assert force_of(machine.values, moved)[1:] == pytest.approx(drive[1:], abs=1e-9)


@pytest.mark.parametrize("kind", tuple(KINDS))
def test_one_case_of_every_kind_is_drawn_and_written_and_read(kind: str, tmp_path: Path) -> None:
    one = made(list(KINDS).index(kind))
    assert one.kind == kind
    folder = write_case(one, tmp_path)
    assert [read_run(folder / f"train_{k}.h5").samples for k in range(len(one.runs))] == [r.samples for r in one.runs]
    assert model_from_json(json.loads((folder / "model.json").read_text())).name.startswith(kind)
    truth = json.loads((folder / "truth.json").read_text())
    assert [h["title"] for h in truth["hidden"]] == [h.title for h in one.hidden]


def test_the_same_seed_gives_the_same_bytes() -> None:
    again = case(5)
    assert again.base_model == made(5).base_model
    for one, other in zip((*again.runs, *again.held_out), (*made(5).runs, *made(5).held_out), strict=True):
        assert one.sample_rate_hz == other.sample_rate_hz
        assert all(one.channels[n].tobytes() == other.channels[n].tobytes() for n in one.channels)
    assert case(5 + 12).runs[0].channels["force"].tobytes() != again.runs[0].channels["force"].tobytes()


def test_every_name_that_may_be_right_is_one_of_the_catalogue() -> None:
    for kind in KINDS:
        machine, *_ = drawn(kind, 4)
        for effect in machine.effects:
            assert effect.names, effect.title
            assert {n for names in effect.names for n in names} <= set(CATALOGUE), effect.title
        assert [e.title for e in machine.outside if e.names] in ([], ["low-pass in the displacement channel"])
        assert any(not e.names for e in machine.outside)


def test_gas_friction_and_asymmetry_have_the_sizes_that_are_stated() -> None:
    machine, _, scale, rng = drawn("mono_tube", 5)
    by_title = {e.title: e for e in machine.effects}
    gas, friction, sides = (
        by_title[t] for t in ("gas behind the rod", "seal friction", "rebound and compression valves differ")
    )
    for _ in range(50):
        assert gas.share[0] <= gas.draw(rng, scale, machine.values)["gas_force"] / scale.force_n <= gas.share[1]
        assert (
            friction.share[0] <= friction.draw(rng, scale, machine.values)["rub"] / scale.force_n <= friction.share[1]
        )
        valves = sides.draw(rng, scale, machine.values)
        ratio = valves["bleed_c"] / valves["bleed_r"]
        assert sides.share[0] <= max(ratio, 1.0 / ratio) <= sides.share[1]


def test_the_recording_chain_does_what_its_numbers_say() -> None:
    _, motion, _, _ = drawn("yaw", 6)
    still = Luck(zero=0.5, clock=0.0, hum=0.0)
    force = 100.0 * np.sin(2.0 * np.pi * 1.0 * np.arange(motion.x.size) * motion.dt)
    plain = sensed(Chain(), still, motion, force)
    assert sensed(Chain(values={"zero_n": 7.0, "wander_n": 2.0}), still, motion, force) == pytest.approx(plain + 8.0)
    late = sensed(Chain(values={"delay_s": 1.0 / motion.rate_hz}), still, motion, force)
    assert late[1:] == pytest.approx(plain[:-1], abs=1e-6)
    fine = sensed(Chain(values={"filter_hz": 10.0}, filter_kind="rc"), still, motion, force)[int(2 * motion.rate_hz) :]
    assert np.max(fine) == pytest.approx(100.0 / np.hypot(1.0, 1.0 / 10.0), rel=2e-3)


def test_an_effect_that_a_refit_of_the_base_absorbs_is_not_identifiable_and_the_others_are() -> None:
    cases = [made(k) for k in range(len(KINDS))]
    for one in cases:
        assert one.identifiable == all(np.hypot(1.0, h.excess) - 1.0 >= 3.0 for h in one.hidden)
    assert sum(one.identifiable for one in cases) >= len(cases) // 2


def test_the_given_model_is_off_by_at_most_a_third() -> None:
    base = (BaseElement(path="core", element="viscous_damping", values={"c": 900.0, "c_control": 0.0},
                        held=frozenset({"c_control"})),)  # fmt: skip
    given = [viscosity(model_file(base, np.random.default_rng(k), "?")) for k in range(40)]
    assert max(given) <= 4 / 3 * 900.0
    assert min(given) >= 3 / 4 * 900.0 * 0.99
    assert np.ptp(given) > 300.0


def viscosity(model: dict[str, Any]) -> float:
    (element,) = model["paths"]["core"]
    assert element["parameters"]["c_control"] == {"value": 0.0, "fixed": True}
    return float(element["parameters"]["c"])


def outcome(names: dict[str, float], *hidden: tuple[tuple[tuple[str, ...], ...], float], **more: object) -> Outcome:
    effects = [
        {"title": "?", "accepted": [list(n) for n in accepted], "identifiable": excess >= 3.0, "in_catalogue": True}
        for accepted, excess in hidden
    ]
    return {
        "kind": "yaw", "seed": 1, "names": names, "hidden": effects, "form": [], "detail": {"turned": []},
        "identifiable": all(h["identifiable"] for h in effects), "verdict": "explained", "seconds": 1.0, **more,
    }  # fmt: skip


GAS = (("gas_spring",), ("force_offset", "linear_stiffness"))
RUB = (("coulomb_friction",), ("presliding_friction",))


@pytest.mark.parametrize(
    ("names", "wrong", "is_exact"),
    [
        ({"gas_spring": 0.9, "coulomb_friction": 0.9}, set(), True),
        ({"force_offset": 0.9, "linear_stiffness": 0.9, "presliding_friction": 0.9}, set(), True),
        ({"coulomb_friction": 0.9}, set(), False),
        ({"gas_spring": 0.9, "coulomb_friction": 0.9, "end_stop": 0.9}, {"end_stop"}, False),
        ({"force_offset": 0.9, "coulomb_friction": 0.9}, {"force_offset"}, False),
    ],
)
def test_a_set_is_exact_when_every_effect_has_one_of_its_names_and_no_name_is_left(
    names: dict[str, float], wrong: set[str], is_exact: bool
) -> None:
    o = outcome(names, (GAS, 9.0), (RUB, 9.0))
    assert (wrong_names(o), exact(o), group(o)) == (wrong, is_exact, "two")
    assert right_names(o) == set(names) - wrong


def test_two_names_for_one_effect_are_one_too_many() -> None:
    o = outcome({"coulomb_friction": 0.9, "presliding_friction": 0.9}, (RUB, 9.0))
    assert len(wrong_names(o)) == 1
    assert not exact(o)


def test_an_effect_below_three_noise_deviations_is_counted_apart_and_may_be_named() -> None:
    silent, named = outcome({}, (RUB, 2.0)), outcome({"coulomb_friction": 0.5}, (RUB, 2.0))
    assert group(silent) == group(named) == "apart"
    assert not wrong_names(named)
    assert "apart" in summary([silent, named])


@pytest.mark.parametrize("name", VARIANTS)
def test_a_variant_is_the_same_measurement_in_another_shape(name: str) -> None:
    asked = question_of(made(5))
    question = replace(asked, runs=(*asked.runs, *(asked.held_out or ()))[1:], held_out=asked.runs[:1])
    other = variant(question, name)
    assert other is not None
    model_from_json(dict(other.model))
    before, after = question.runs[-1], other.runs[-1]
    if name == "force × 1000":
        assert after.channels["force"] == pytest.approx(1000.0 * before.channels["force"])
        assert other.model != question.model
    elif name == "other held out":
        assert other.held_out is not None
        assert other.held_out[0] is question.runs[0]
    else:
        assert after.samples == pytest.approx(before.samples / 2, abs=1)


def measured(folder: Path, zero_n: float = 40.0) -> list[MeasuredSet]:
    """A set of three run files that a bench might have recorded, of a viscous damper."""
    for k, hz in enumerate((0.7, 1.5, 3.0)):
        rng = np.random.default_rng(k)
        t = np.arange(0.0, 6.0, 1.0 / 200.0)
        x = 0.01 * np.sin(2.0 * np.pi * hz * t)
        run = Run(
            run_id=f"sine-{k}", created="2026-01-01T00:00:00+00:00", specimen="one", sample_rate_hz=200.0,
            period_samples=0, excitation_kind="sine", status="complete", units={"displacement": "m", "force": "N"},
            channels={"displacement": x + rng.normal(0.0, 1e-6, t.size),
                      "force": 900.0 * np.gradient(x, t) + zero_n + rng.normal(0.0, 0.3, t.size)},
        )  # fmt: skip
        write_run(folder / f"run_{k}.h5", run)
    return measured_sets(folder.parent)


def test_measured_runs_are_tared_and_their_noise_is_seen(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    (one,) = measured(tmp_path / "one")
    assert abs(np.mean(np.concatenate([r.channels["force"] for r in one.runs]))) < 1e-9
    assert noise_of(one.runs[0]) == pytest.approx(0.3, rel=0.15)
    assert measured_sets(tmp_path / "missing") == []


def test_a_recorders_text_is_cut_into_runs_with_the_sign_of_a_damper(tmp_path: Path) -> None:
    lines = ["Timestamp,Force (V),Force (N),Displacement (V),Displacement (mm),Temperature (V),Temperature (C)"]
    begin = datetime(2026, 1, 1, tzinfo=UTC)
    for k in range(3600):
        stamp = (begin + timedelta(seconds=k / 300.0)).replace(tzinfo=None).isoformat(sep=" ", timespec="microseconds")
        x = 10.0 * np.sin(2.0 * np.pi * 1.5 * k / 300.0)
        force = -50.0 * np.cos(2.0 * np.pi * 1.5 * k / 300.0)
        lines.append(f"{stamp},0,{force + 7.0},0,{x + 20.0},0,25")
    (tmp_path / "trial.csv").write_text("\n".join(lines), encoding="utf-8")
    (one,) = measured_sets(tmp_path)
    assert one.name == "trial"
    assert len(one.runs) == 4
    for run in one.runs:
        assert run.sample_rate_hz == 300.0
        assert np.sum(np.gradient(run.channels["displacement"]) * run.channels["force"]) > 0.0


def test_an_effect_that_is_added_to_measured_runs_is_the_only_difference(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    sets = measured(tmp_path / "one")
    zero = next(k for k in range(40) if injected(k, sets).hidden.title == "load cell not tared")
    made = injected(zero, sets)
    assert made.hidden.accepted[0] == ("force_offset",)
    assert made.identifiable
    for own, run in zip((*made.own_runs, *made.own_held), (*made.runs, *made.held_out), strict=True):
        added = run.channels["force"] - own.channels["force"]
        assert np.std(added) < 1e-9 * np.max(np.abs(added))
        assert np.array_equal(run.channels["displacement"], own.channels["displacement"])
    bush = injected(next(k for k in range(40) if "bush" in injected(k, sets).hidden.title), sets)
    stretch = bush.runs[0].channels["displacement"] - bush.own_runs[0].channels["displacement"]
    assert np.corrcoef(stretch, bush.runs[0].channels["force"])[0, 1] == pytest.approx(1.0)


def test_without_measured_runs_the_benchmark_says_so_in_a_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["--measured", str(tmp_path / "missing")])
    said = capsys.readouterr().out
    assert said.count("\n") == 1
    assert "missing" in said


@pytest.mark.slow
@pytest.mark.parametrize("seed", [20003, 20004])
def test_beside_what_no_element_describes_there_are_one_or_two_effects_that_some_do(seed: int) -> None:
    made = case(seed, beside=True)
    known = [h for h in made.hidden if h.in_catalogue]
    assert len(made.hidden) > len(known) >= 1
    assert len(made.hidden) <= 3


@pytest.mark.slow
@pytest.mark.parametrize("seed", [10704, 10301, 10302])
def test_no_case_has_two_effects_of_which_one_excludes_the_other(seed: int) -> None:
    rng = np.random.default_rng([7, seed])
    hidden = made(seed)
    excludes = {e.title: e.excludes for e in KINDS[hidden.kind](rng).effects}
    titles = {h.title for h in hidden.hidden}
    assert not any(excludes.get(title, frozenset()) & titles for title in titles)


def test_a_set_of_runs_of_two_rates_can_be_judged() -> None:
    """A late current is tried by as many delays in every run, whatever its rate."""
    counts = set()
    for rate in (200.0, 1000.0):
        t = np.arange(round(2.0 * rate)) / rate
        seen = Seen(x=np.sin(t), v=np.cos(t), a=-np.sin(t), i=np.sin(3.0 * t), warm=t, t=t, moving=t > -1.0, force=t)
        setting = Setting(seen=seen, force=t, base=(), stroke_m=1.0, speed_m_s=1.0, current_a=1.0)
        counts.add(len(ADDED["control_delay"](setting)))
    assert len(counts) == 1
