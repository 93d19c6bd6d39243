"""Effects are hidden by name or seed, change the force, and share no equation with identification."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

from sim_rig.damper import RINGS, STATE, mount, orifices, springs
from sim_rig.draw import draw, scale_of, write_truth
from sim_rig.effects import EFFECTS, LISTED, UNLISTED, refusal
from sim_rig.errors import SimRigError, SpecimenError
from sim_rig.plant import SimulatedPlant
from sim_rig.sensors import Noise
from sim_rig.server import serve
from sim_rig.sizes import SIZES
from sim_rig.specimens import SPECIMENS

SILENT = Noise(force_n=0.0, displacement_m=0.0, current_a=0.0, temperature_degc=0.0, pressure_pa=0.0)
CATALOGUE = """
viscous_damping arctan_damping piecewise_linear_damping valve_damping quadratic_damping relief_valve
damping_asymmetry tanh_hysteresis bouc_wen coulomb_friction stribeck_friction presliding_friction linear_stiffness
cubic_stiffness gas_spring end_stop position_dependent_damping temperature_fade reversal_force_lag series_compliance
free_play control_lag control_delay control_saturation control_hysteresis force_delay force_offset moving_mass
force_drift mains_hum
"""


def played(name: str, hide: tuple[str, ...] = (), seed: int = 1, noise: Noise = SILENT) -> NDArray[np.float64]:
    """Sensor readings of three seconds of motion with changing current."""
    found, truth = SPECIMENS[name], draw(name, hide, seed)
    plant = SimulatedPlant(truth.damper, noise, seed=seed, start_degc=40.0)
    time = np.arange(3000) / 1000.0
    x = found.stroke_m * np.sin(found.speed_m_s / found.stroke_m * time) * np.minimum(time / 0.3, 1.0)
    low, high = found.current_a or (0.0, 0.0)
    current = low + (high - low) * ((time * 3) % 1.0 > 0.5)
    return plant.play(np.column_stack([x, current]))


def test_every_element_of_the_catalogue_and_five_more_can_be_hidden() -> None:
    assert set(LISTED) == set(CATALOGUE.split())
    assert len(UNLISTED) >= 4
    assert not set(UNLISTED) & set(CATALOGUE.split())
    for name in EFFECTS:
        assert any(not refusal(s.damper, name, scale_of(s)) for s in SPECIMENS.values()), name


@pytest.mark.parametrize("specimen", list(SPECIMENS))
def test_every_effect_that_a_specimen_takes_changes_its_force_and_keeps_it_finite(specimen: str) -> None:
    plain = played(specimen)[:, 0]
    rms = np.std(plain)
    assert rms > 0.2 * SPECIMENS[specimen].force_rms_n
    for name in EFFECTS:
        if refusal(SPECIMENS[specimen].damper, name, scale_of(SPECIMENS[specimen])):
            continue
        force = played(specimen, (name,))[:, 0]
        assert np.all(np.isfinite(force)), name
        change = np.sqrt(np.mean((force - plain) ** 2)) / rms
        assert 0.002 < change < 1.5, f"{name} changes {change:.2%}"
        assert np.std(force) > 0.3 * rms, f"{name} leaves a force of {np.std(force):.3g} N where there were {rms:.3g} N"


def test_a_joint_with_play_carries_nothing_between_its_ends_and_damps_where_it_touches() -> None:
    p = SPECIMENS["semi-active"].damper._replace(play=1e-4)
    state, scratch = np.zeros(STATE), np.zeros(RINGS)
    at = np.linspace(-1e-4, 1e-4, 401)
    at_rest, moving = (np.array([mount(p, state, scratch, e, rate, 6e-5) for e in at]) for rate in (0.0, 0.1))
    within = np.abs(at) < 0.4 * p.play
    assert np.all(at_rest[within] == 0.0)
    assert np.all(moving[within] == 0.0)
    assert np.all(at_rest * at >= 0.0)
    assert np.all(moving >= at_rest)


def test_a_relief_valve_and_an_end_stop_do_nothing_before_they_act() -> None:
    plain = SPECIMENS["passive"].damper
    valve = plain._replace(relief=500.0, relief_knee=0.2)
    stop = plain._replace(stop=1e5, stop_at=0.02)
    for slow in (-0.1, -1e-3, 1e-3, 0.1):
        assert orifices(valve, slow, 0.0) == orifices(plain, slow, 0.0)
    for near in (-0.015, -1e-4, 1e-4, 0.015):
        assert springs(stop, near, 20.0) == springs(plain, near, 20.0)
    assert orifices(plain, 0.5, 0.0) - orifices(valve, 0.5, 0.0) == pytest.approx(500.0 * 0.3, rel=0.02)
    assert springs(stop, 0.025, 20.0) - springs(plain, 0.025, 20.0) == pytest.approx(1e5 * 0.005 * 1.5, rel=0.02)


def test_a_passive_damper_absorbs_energy() -> None:
    for name in ("passive", "yaw", "railway"):
        values = played(name)
        assert np.sum(values[:-1, 0] * np.diff(values[:, 1])) > 0


def test_a_seed_draws_the_same_again_and_another_seed_another() -> None:
    assert draw("semi-active", ["random"], 7) == draw("semi-active", ["random"], 7)
    drawn = {draw("semi-active", ["random"], seed).hidden[0].effect for seed in range(120)}
    assert drawn == {name for name in SIZES["semi-active"] if name in LISTED}
    pair = draw("semi-active", ["random", "random", "sticking_patch"], 3).hidden
    assert len({item.effect for item in pair}) == 3
    assert [item.listed for item in pair] == [True, True, False]


def test_what_is_measured_depends_on_the_seed() -> None:
    noise = SPECIMENS["mr"].noise
    one, same, other = (played("mr", noise=noise, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert np.any(one != other)


def test_noise_is_one_per_cent_of_the_typical_force_and_a_micrometre() -> None:
    found = SPECIMENS["semi-active"]
    difference = played("semi-active", noise=found.noise) - played("semi-active")
    assert np.std(difference[:, 0]) == pytest.approx(0.01 * found.force_rms_n, rel=0.1)
    assert np.std(difference[:, 1]) == pytest.approx(1e-6, rel=0.1)


def test_a_step_of_current_is_a_step_at_its_sample() -> None:
    found = SPECIMENS["semi-active"]
    plant = SimulatedPlant(found.damper, SILENT, seed=1, start_degc=25.0)
    current = np.where(np.arange(200) < 100, 0.4, 1.4)
    measured = plant.play(np.column_stack([np.zeros(200), current]))[:, 2]
    assert np.all(np.abs(measured[50:100] - 0.4) < 1e-6)
    assert measured[100] > 1.1
    assert np.all(np.abs(measured[102:] - 1.4) < 1e-3)


def test_displacement_and_force_have_no_skew() -> None:
    """A rigid specimen's force follows the measured velocity with no delay: to a few microseconds."""
    found, samples = SPECIMENS["passive"], 3000
    plant = SimulatedPlant(found.damper, SILENT, seed=1, start_degc=40.0)
    omega = 4 * np.pi
    x = 0.02 * np.sin(omega * np.arange(samples) / 1000.0)
    values = plant.play(np.column_stack([x, np.zeros(samples)]))[1000:]
    basis = np.exp(-1j * omega * np.arange(2000) / 1000.0)
    lag = np.angle(np.sum(values[:, 0] * basis) / np.sum(values[:, 1] * basis)) - np.pi / 2
    assert abs(lag / omega) < 2e-5


def test_a_test_warms_the_damper() -> None:
    values = played("semi-active")
    plant_start = 40.0
    assert values[-1, 3] != pytest.approx(plant_start, abs=0.05)


def test_the_truth_is_written_only_on_request(tmp_path: Path) -> None:
    write_truth(draw("yaw", ["coulomb_friction"], 2), tmp_path / "truth.json")
    told = json.loads((tmp_path / "truth.json").read_text())
    assert told["hidden"][0]["effect"] == "coulomb_friction"
    assert told["hidden"][0]["parameters"]["coulomb"] > 0
    assert [entry.name for entry in tmp_path.iterdir()] == ["truth.json"]


@pytest.mark.parametrize(
    ("specimen", "hide", "seed", "words"),
    [
        ("lever", [], 1, "choose one of semi-active"),
        ("yaw", ["gremlin"], 1, "choose random or one of viscous_damping"),
        ("yaw", ["control_lag"], 1, "no current"),
        ("yaw", ["series_compliance"], 1, "by design"),
        ("yaw", ["end_stop", "end_stop"], 1, "twice"),
        ("yaw", [], -1, "seed is -1"),
    ],
)
def test_what_does_not_exist_is_refused_in_one_line(specimen: str, hide: list[str], seed: int, words: str) -> None:
    with pytest.raises(SpecimenError, match=words) as caught:
        draw(specimen, hide, seed)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan")])
def test_an_impossible_speed_is_refused(speed: float) -> None:
    with pytest.raises(SimRigError, match="speed"):
        serve("modbus://127.0.0.1:0", speed=speed)


@pytest.mark.parametrize("path", sorted(Path("examples/models").glob("*.json")), ids=lambda path: path.stem)
def test_every_specimen_has_a_base_model_to_start_from(path: Path) -> None:
    model = json.loads(path.read_text())
    assert path.stem in SPECIMENS
    assert model["format"] == "damper-rig/model"
    assert {element["element"] for elements in model["paths"].values() for element in elements} <= set(
        CATALOGUE.split()
    )


def test_no_specimen_lacks_its_base_model() -> None:
    assert {path.stem for path in Path("examples/models").glob("*.json")} == set(SPECIMENS)


def test_the_loop_of_the_seat_damper_has_a_slope_that_falls_with_speed() -> None:
    """Its slope varies with the peak speed of a sine to the power −0.86, as measured on a seat damper."""
    slopes = []
    for peak in (0.1, 0.4):
        truth = draw("mr-seat", (), 1)
        plant = SimulatedPlant(truth.damper, SILENT, seed=1, start_degc=25.0)
        time, turn = np.arange(6000) / 1000.0, 2.0 * np.pi * 2.0
        x = peak / turn * np.sin(turn * time) * np.minimum(time, 1.0)
        force = plant.play(np.column_stack([x, np.full(time.size, 0.6)]))[4000:]
        v = np.gradient(force[:, 1], 1e-3)

        def left(q: NDArray[np.float64], f: NDArray[np.float64] = force, v: NDArray[np.float64] = v) -> object:
            side = np.tanh(q[1] * v + q[2] * np.sign(f[:, 1])) * q[0]
            return side + q[3] * v + q[4] * f[:, 1] + q[5] - f[:, 0]

        slopes.append(least_squares(left, [600.0, 5.0 / peak, 0.5, 1500.0, 0.0, -90.0], x_scale="jac").x[1])
    assert slopes[0] / slopes[1] == pytest.approx(4.0**0.8621, rel=0.15)
