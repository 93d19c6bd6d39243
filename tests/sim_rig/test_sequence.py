"""A plan on the simulated rig: prompts, tare, gates, warm-up by energy, and what follows where one refuses."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excitation.plan import Test, test_from_config
from rigctl.device import SAFE_STATES
from rigctl.errors import Declined, GateError, InterlockTripped, IterationError, NeedsReset, ProcedureError, RigError
from rigctl.interlocks import interlock
from rigctl.iterate import iterate
from rigctl.player import PlayerSettings, play
from rigctl.runfile import read_run
from rigctl.sequence import Played, Sequence
from rigctl.setup import Setup
from rigctl.warm_up import conditioned
from tests.sim_rig.laboratory import NOTHING, CutFrom, Laboratory, Person

SINE = {"name": "t", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.01, "frequency": 4.0, "cycles": 2}
SPECIMEN = NOTHING._replace(c=2000.0, offset=40.0, heat_capacity=160.0, cooling=0.1)
QUICK = PlayerSettings(ramp_s=0.2)


def a_test(*before: dict[str, Any], **more: Any) -> Test:
    return test_from_config({**SINE, "before": list(before), **more})


def sequence(
    laboratory: Laboratory, folder: Path, person: Person, settings: PlayerSettings = QUICK, **more: Any
) -> Sequence:
    def one(test: Test, out_dir: Path, setup: Setup) -> Path:
        return play(laboratory.wire, test, out_dir, clock=laboratory.clock, settings=settings, setup=setup)

    return Sequence(
        transport=laboratory.wire,
        play=one,
        out_dir=folder,
        operator=person,
        clock=laboratory.clock,
        **more,
    )


def test_the_steps_before_a_test_are_done_in_order_and_stand_in_its_file(tmp_path: Path) -> None:
    person, laboratory = Person(readings=(22.5,)), Laboratory(SPECIMEN)
    test = a_test(
        {"step": "prompt", "text": "Fit the clevis"},
        {"step": "tare", "readings": 60},
        {"step": "gate", "of": "ambient", "min": 18.0, "max": 28.0},
        {"step": "gate", "of": "oil", "max": 40.0},
    )
    done = sequence(laboratory, tmp_path, person, setup=Setup(oil="ISO VG 32")).run(test)
    assert [text[:7] for text in person.asked] == ["Fit the", "Tempera"]
    assert done.path is not None
    run = read_run(done.path)
    assert (run.setup.oil, run.setup.ambient_degc, run.status) == ("ISO VG 32", 22.5, "complete")
    assert run.setup.tare is not None
    assert run.setup.tare.offset_n == pytest.approx(40.0, abs=6.0)
    assert abs(np.mean(run.channels["force"])) < 6.0, "40 N are removed"
    assert any("the operator confirmed: Fit the clevis" in text for _, text in run.events)
    assert any("tare of" in text for _, text in run.events)


def test_the_next_test_keeps_the_tare_and_not_the_prompt(tmp_path: Path) -> None:
    plan = sequence(Laboratory(SPECIMEN), tmp_path, Person())
    first = plan.run(a_test({"step": "tare", "readings": 60}, {"step": "prompt", "text": "Close the door"}))
    second = plan.run(replace(a_test(), name="second"))
    runs = [read_run(one.path) for one in (first, second) if one.path]
    assert runs[0].setup.tare == runs[1].setup.tare
    assert not any("door" in text for _, text in runs[1].events)


def test_a_warm_up_gives_the_damper_the_energy_that_was_asked_for(tmp_path: Path) -> None:
    warm_up = test_from_config({**SINE, "name": "warm-up", "amplitude": 0.02, "cycles": 4, "energy": 900.0})
    laboratory = Laboratory(SPECIMEN)
    before = laboratory.rig.controller.measured[3]
    plan = sequence(laboratory, tmp_path, Person(), warm_up=warm_up)
    runs = [read_run(done.path) for done in (plan.run(a_test()), plan.run(a_test(name="u"))) if done.path]
    record = runs[0].setup.warm_up
    assert record is not None
    assert runs[1].setup.warm_up == record, "once, before the first test"
    each = 4 * np.pi * 2000.0 * (2 * np.pi * 4) * 0.02**2  # J, by the viscous damper in four cycles
    assert record.energy_j == pytest.approx(record.plays * each, rel=0.05)
    assert 900.0 <= record.energy_j < 900.0 + 1.1 * each
    warmed = runs[0].channels["temperature"][0] - before
    assert warmed == pytest.approx(record.energy_j / 160.0, rel=0.25), "fades and cooling aside"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["t.h5", "u.h5"]


def test_a_warm_up_to_a_temperature_ends_there_or_says_what_is_missing(tmp_path: Path) -> None:
    warm_up = test_from_config({**SINE, "name": "warm-up", "amplitude": 0.02, "cycles": 8, "to_temperature": 27.0})
    laboratory = Laboratory(SPECIMEN)
    one = partial(play, laboratory.wire, clock=laboratory.clock, settings=QUICK)
    done = conditioned(one, warm_up)
    assert done.end_degc >= 27.0 > done.start_degc
    with pytest.raises(GateError, match=r"°C of 90 °C"):
        conditioned(one, replace(warm_up, to_temperature_degc=90.0), gate_s=3.0)


def test_an_operator_who_does_not_confirm_ends_the_plan_before_anything_moves(tmp_path: Path) -> None:
    laboratory = Laboratory(SPECIMEN)
    plan = sequence(laboratory, tmp_path, Person(yes=False))
    with pytest.raises(Declined):
        plan.run(a_test({"step": "prompt", "text": "Fit it"}, on_failure="skip"))
    assert not np.any(np.concatenate(laboratory.commands))
    assert not list(tmp_path.iterdir())


TOO_WARM = {"step": "gate", "of": "ambient", "max": 20.0}


def test_a_refused_step_stops_skips_or_is_tried_again_as_the_test_says(tmp_path: Path) -> None:
    def tried(on_failure: str, readings: tuple[float, ...], **more: Any) -> tuple[Played, Person]:
        person = Person(readings=readings)
        plan = sequence(Laboratory(SPECIMEN), tmp_path / f"{on_failure}{len(readings)}", person)
        return plan.run(a_test(TOO_WARM, on_failure=on_failure, **more)), person

    with pytest.raises(GateError, match="room is at 25"):
        tried("stop", (25.0,))
    skipped, _ = tried("skip", (25.0,))
    assert (skipped.path, skipped.skipped) == (
        None,
        "the room is at 25 °C: the test needs ambient temperature up to 20 °C",
    )
    done, person = tried("retry", (25.0, 24.0, 19.0), retries=2)
    assert len(person.asked) == 3
    assert done.path is not None
    assert any("attempt 3, after: the room is at 24" in text for _, text in read_run(done.path).events)
    with pytest.raises(GateError, match="room is at 24"):
        tried("retry", (25.0, 24.0), retries=1)


def test_a_refused_tare_and_a_tripped_interlock_obey_the_rule_and_a_fault_of_the_rig_does_not(tmp_path: Path) -> None:
    attached = Laboratory(SPECIMEN._replace(offset=1500.0))
    tare = {"step": "tare", "readings": 60}
    with pytest.raises(ProcedureError, match="detach"):
        sequence(attached, tmp_path / "a", Person()).run(a_test(tare))
    assert "detach" in sequence(attached, tmp_path / "b", Person()).run(a_test(tare, on_failure="skip")).skipped
    strict = replace(QUICK, interlocks=(interlock("force:-200:200:stop"),))
    skipped = sequence(Laboratory(SPECIMEN), tmp_path / "c", Person(), strict).run(a_test(on_failure="skip"))
    assert skipped.path is not None
    assert read_run(skipped.path).status == "aborted"
    with pytest.raises(InterlockTripped):
        sequence(Laboratory(SPECIMEN), tmp_path / "d", Person(), strict).run(a_test(on_failure="retry"))
    assert len(list((tmp_path / "d").iterdir())) == 2, "both attempts are kept"
    with pytest.raises(NeedsReset):  # the tare before it has tripped the rig's own force limit
        sequence(Laboratory(SPECIMEN._replace(offset=30e3)), tmp_path / "e", Person()).run(a_test(on_failure="skip"))


def test_a_gate_of_the_oil_waits_for_cooling_as_long_as_it_says(tmp_path: Path) -> None:
    specimen = SPECIMEN._replace(cooling=16.0)
    warm = Laboratory(specimen)
    warm.plant.heat(30.0)
    gate = {"step": "gate", "of": "oil", "max": 28.0, "wait": 20.0}
    done = sequence(warm, tmp_path, Person()).run(a_test(gate))
    assert done.path is not None
    hot = Laboratory(specimen)
    hot.plant.heat(90.0)
    with pytest.raises(GateError, match=r"damper is at (90|8[89])"):
        sequence(hot, tmp_path, Person()).run(a_test({**gate, "wait": 0.0}))


def test_an_iteration_refuses_a_test_whose_steps_it_would_not_do() -> None:
    with pytest.raises(IterationError, match="steps before it"):
        iterate(lambda test: pytest.fail("played"), a_test({"step": "prompt", "text": "Fit it"}))


def test_from_whichever_call_the_wire_is_cut_a_plan_with_steps_ends_with_a_rig_without_motion(tmp_path: Path) -> None:
    test = a_test({"step": "tare", "readings": 20}, {"step": "gate", "of": "oil", "max": 40.0}, cycles=1)
    for nth in count(3, 17):
        laboratory = Laboratory(SPECIMEN)
        laboratory.wire = wire = CutFrom(laboratory.wire, nth)
        plan = sequence(laboratory, tmp_path / str(nth), Person())
        with suppress(RigError):
            plan.run(test)
        for _ in range(300):
            laboratory.clock.sleep(0.01)
            laboratory.rig.tick()
        assert laboratory.rig.controller.state in SAFE_STATES
        assert not list((tmp_path / str(nth)).glob("*.part"))
        if wire.calls < nth:
            return
