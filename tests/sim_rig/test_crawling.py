"""Crawl, weighing and inertia compensation give back what is in the simulated specimen, within what they state."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from excitation.kinds import Kind
from excitation.plan import Test
from excitation.signal import Excitation
from rigctl.errors import ProcedureError
from rigctl.player import PlayerSettings, play
from rigctl.preparation import Mass
from rigctl.procedures.compensate import compensate
from rigctl.procedures.crawl import CrawlSettings, crawl_of, crawl_test
from rigctl.procedures.weigh import WeighSettings, mass_of, weigh_test
from rigctl.runfile import Run, read_run, write_run
from sim_rig import damper
from tests.sim_rig.laboratory import NOTHING, Laboratory

SHORT = CrawlSettings(amplitude_m=0.004, cycles=1)
QUICK = PlayerSettings(ramp_s=0.3)


def played(laboratory: Laboratory, test: Test, folder: Path) -> Run:
    return read_run(play(laboratory.wire, test, folder, clock=laboratory.clock, settings=QUICK))


def test_a_crawl_finds_gas_force_spring_rate_and_friction(tmp_path: Path) -> None:
    within = np.zeros(3)
    for seed in range(5):
        random = np.random.default_rng(seed)
        specimen = NOTHING._replace(
            stiffness=random.uniform(0, 20e3),
            preload=random.uniform(-500, 0),
            gas=random.uniform(50, 400),
            gas_length=random.uniform(0.1, 0.3),
            coulomb=random.uniform(5, 150),
            c=random.uniform(200, 3000),
            scale_m=0.03,
        )
        laboratory = Laboratory(specimen, seed=seed, noise_n=random.uniform(2, 15))
        found = crawl_of(played(laboratory, crawl_test(SHORT), tmp_path))
        force = [damper.springs(specimen, x, 22.0) for x in (-1e-6, 0.0, 1e-6)]
        true = (
            (found.gas_n, force[1]),
            (found.spring_n_m, (force[2] - force[0]) / 2e-6),
            (found.friction_n, damper.friction(specimen, found.speed_m_s) + specimen.c * found.speed_m_s),
        )
        off = np.array([abs(one.value - value) / one.uncertainty for one, value in true])
        assert np.all(off < 4), (seed, off)
        within += off < 2
    assert np.all(within >= 3)  # of five, where 95 % are expected


def a_run(**changes: object) -> Run:
    """A noisy crawl on a spring of 5 kN/m with 30 N of friction, without a rig."""
    test = crawl_test(SHORT)
    x = test.excitation.displacement_m
    force = -200 + 5e3 * x + 30 * np.sign(np.gradient(x)) + np.random.default_rng(1).normal(size=x.size)
    run = Run(
        run_id="r",
        created="2026-01-02T03:04:05+00:00",
        specimen="s",
        sample_rate_hz=1000.0,
        period_samples=test.excitation.period_samples,
        excitation_kind="triangle",
        status="complete",
        channels={"displacement": x, "force": force, "displacement_command": x},
        units={"displacement": "m", "force": "N", "displacement_command": "m"},
    )
    return replace(run, **changes)  # type: ignore[arg-type]  # fields of a run


def test_what_is_no_slow_triangle_is_refused() -> None:
    assert crawl_of(a_run()).friction_n.value == pytest.approx(30, abs=0.2)
    with pytest.raises(ProcedureError, match="slow triangle"):
        crawl_of(a_run(excitation_kind="sine"))
    uncommanded = {name: values for name, values in a_run().channels.items() if name != "displacement_command"}
    with pytest.raises(ProcedureError, match="displacement_command"):
        crawl_of(a_run(channels=uncommanded))
    with pytest.raises(ProcedureError, match="speed"):
        CrawlSettings(speed_m_s=0.5)


def test_a_mass_is_weighed_without_a_specimen(tmp_path: Path) -> None:
    within = 0
    for seed in range(4):
        random = np.random.default_rng(seed)
        kilograms = random.uniform(0, 8)
        laboratory = Laboratory(NOTHING._replace(mass=kilograms, offset=50.0), seed=seed, noise_n=random.uniform(2, 15))
        found = mass_of(played(laboratory, weigh_test(WeighSettings(periods=5, seed=seed)), tmp_path))
        assert abs(found.mass_kg - kilograms) < 4 * found.uncertainty_kg
        assert found.uncertainty_kg < 0.1
        within += abs(found.mass_kg - kilograms) < 2 * found.uncertainty_kg
    assert within >= 3


def test_with_a_specimen_a_mass_is_stated_less_sure_and_only_where_asked_for(tmp_path: Path) -> None:
    laboratory = Laboratory(NOTHING._replace(mass=3.0, c=2000.0, stiffness=2e4))
    run = played(laboratory, weigh_test(WeighSettings(periods=5)), tmp_path)
    with pytest.raises(ProcedureError, match="something is attached"):
        mass_of(run)
    found = mass_of(run, with_specimen=True)
    assert abs(found.mass_kg - 3.0) < 2 * found.uncertainty_kg
    assert found.uncertainty_kg > 0.1
    rubbing = Laboratory(NOTHING._replace(mass=3.0, c=2000.0, coulomb=150.0))
    with pytest.raises(ProcedureError, match="neither a mass nor a spring"):
        mass_of(played(rubbing, weigh_test(WeighSettings(periods=5)), tmp_path), with_specimen=True)


def a_fast_sine() -> Test:
    time = np.arange(1500) / 1000.0
    x = 0.006 * np.sin(2 * np.pi * 10 * time)
    return Test(
        name="fast", excitation=Excitation(kind=Kind.SINE, sample_rate_hz=1000.0, period_samples=100, displacement_m=x)
    )


MASS = Mass(
    rig="damper-rig sim_rig 1",
    measured_at="2026-06-01T08:00:00+00:00",
    mass_kg=6.0,
    uncertainty_kg=0.02,
    stiffness_n_m=0.0,
    stiffness_uncertainty_n_m=100.0,
    from_hz=8.0,
    to_hz=30.0,
    run="r",
)


def test_compensation_gives_the_force_of_the_same_specimen_without_the_mass(tmp_path: Path) -> None:
    specimen = NOTHING._replace(c=2000.0, stiffness=1e4)
    heavy = played(Laboratory(specimen._replace(mass=6.0), noise_n=1.0), a_fast_sine(), tmp_path)
    made = compensate(heavy, MASS)
    middle = slice(300, 1200)
    x = heavy.channels["displacement"]
    wanted = 2000.0 * np.gradient(x) * 1000 + 1e4 * x
    before = np.std((heavy.channels["force"] - wanted)[middle])
    after = np.std((made.run.channels["force"] - wanted)[middle])
    assert before > 50
    assert after < 2.5 * np.hypot(made.uncertainty_n, 1.0)
    np.testing.assert_array_equal(made.run.channels["force_measured"], heavy.channels["force"])
    assert np.sqrt(np.mean(made.run.channels["force_uncertainty"] ** 2)) == pytest.approx(made.uncertainty_n)
    assert made.bandwidth_hz > 80
    write_run(tmp_path / "made.h5", made.run)
    again = read_run(tmp_path / "made.h5")
    assert again.setup.compensated == MASS
    with pytest.raises(ProcedureError, match="compensated before"):
        compensate(again, MASS)


def test_a_mass_of_another_rig_is_refused(tmp_path: Path) -> None:
    run = played(Laboratory(NOTHING), a_fast_sine(), tmp_path)
    with pytest.raises(ProcedureError, match="other rig"):
        compensate(run, replace(MASS, rig="other rig"))
    with pytest.raises(ProcedureError, match="bandwidth"):
        compensate(run, MASS, bandwidth_hz=400.0)
