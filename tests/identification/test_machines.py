"""Machines that are no dampers, driven by a force: what the displacement's own noise does to a stiff or heavy model."""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from identification.derivatives import periodic_kinematics
from identification.discrepancy import Verdict, explain
from identification.fitting.leastsquares import fit_records
from identification.physical.model import Element, Model, element
from identification.record import compact, record_from_run
from rigctl.runfile import Run

Floats = NDArray[np.float64]

RATE = 610.0
FINE = 12


def captured(name: str, rate: float, x: Floats, force: Floats, period: int = 0) -> Run:
    return Run(
        run_id=name, created="2026-01-01T00:00:00+00:00", specimen="machine", sample_rate_hz=rate,
        period_samples=period, excitation_kind="multisine" if period else "custom", status="complete",
        channels={"displacement": x, "force": force}, units={"displacement": "m", "force": "N"},
    )  # fmt: skip


@numba.njit
def duffing(u: Floats, h: float, m: float, d: float, k: float, k3: float) -> Floats:
    """Runge–Kutta over inputs at half steps."""
    x, v, n = 0.0, 0.0, u.size // 2
    out = np.empty(n)
    for j in range(n):
        out[j] = x
        a, b, c = u[2 * j], u[2 * j + 1], u[min(2 * j + 2, u.size - 1)]
        p1, q1 = v, (a - d * v - k * x - k3 * x**3) / m
        y, w = x + 0.5 * h * p1, v + 0.5 * h * q1
        p2, q2 = w, (b - d * w - k * y - k3 * y**3) / m
        y, w = x + 0.5 * h * p2, v + 0.5 * h * q2
        p3, q3 = w, (b - d * w - k * y - k3 * y**3) / m
        y, w = x + h * p3, v + h * q3
        p4, q4 = w, (c - d * w - k * y - k3 * y**3) / m
        x, v = x + h / 6 * (p1 + 2 * p2 + 2 * p3 + p4), v + h / 6 * (q1 + 2 * q2 + 2 * q3 + q4)
    return out


def resonator(seed: int, *, k3: float, periodic: bool, noise: float = 1e-3) -> tuple[Model, list[Run], list[Run]]:
    """A mass on a spring with a resonance at 68 Hz, driven by a random-phase force up to 200 Hz."""
    rng = np.random.default_rng(seed)
    w0, n = 2 * np.pi * 68.0, 1024
    m, d = 1 / w0**2, 0.07 / w0
    lines = np.arange(1, int(200 / RATE * n), 2)
    runs = []
    for r in range(6):
        spectrum = np.zeros(n * FINE + 1, dtype=complex)
        spectrum[lines] = np.exp(2j * np.pi * rng.random(lines.size))
        fine = np.fft.irfft(spectrum, 2 * n * FINE)
        fine *= (0.02 + 0.01 * r) / np.std(fine)
        x = duffing(np.tile(fine, 8), 1 / RATE / FINE, m, d, 1.0, k3)[::FINE][4 * n :]
        x = x + noise * np.std(x) * rng.standard_normal(x.size)
        force = np.tile(fine[:: 2 * FINE], 4)
        force = force + 1e-4 * np.std(force) * rng.standard_normal(force.size)
        runs.append(captured(f"run {r}", RATE, x, force, n if periodic else 0))
    base = Model(
        name="linear", elements=(element("viscous_damping", {"c": 1.2 * d}), element("linear_stiffness", {"k": 0.85}),
                                 element("moving_mass", {"m": 1.1 * m})))  # fmt: skip
    return base, runs[:4], runs[4:]


@pytest.mark.parametrize("periodic", [True, False], ids=["over periods", "without periods"])
@pytest.mark.parametrize(
    "k3", [4.0, pytest.param(-1.0, marks=pytest.mark.slow), 0.0], ids=["hardening", "softening", "linear"]
)
def test_a_spring_that_bends_is_named_beneath_the_noise_that_a_mass_makes_of_a_displacement(
    k3: float, periodic: bool
) -> None:
    found = explain(*resonator(1, k3=k3, periodic=periodic))
    assert [e.element for e in found.effects] == (["cubic_stiffness"] if k3 else [])
    assert found.verdict == (Verdict.EXPLAINED if k3 else Verdict.NO_DISCREPANCY)
    assert found.held_out.final < max(0.1 * found.held_out.base_refitted, 1.2 * found.held_out.noise_floor)


def test_a_displacement_that_is_rounded_the_same_in_every_period_keeps_the_lines_that_were_excited() -> None:
    t = np.arange(1000) / 1000.0
    x = np.sin(2 * np.pi * 3 * t) + 0.2 * np.sin(2 * np.pi * 11 * t)
    rounded = np.tile(np.round(x / 1e-2) * 1e-2, (3, 1))
    motion = periodic_kinematics(rounded, 1000.0)
    assert motion.bandwidth_hz < 40.0
    exact = -((2 * np.pi * 3) ** 2) * np.sin(2 * np.pi * 3 * t) - 0.2 * (2 * np.pi * 11) ** 2 * np.sin(22 * np.pi * t)
    assert np.std(motion.a - exact) < 0.2 * np.std(exact)


@numba.njit
def slide(reference: Floats, speed: Floats, rate: float, step: float) -> tuple[Floats, Floats]:
    """A slide of 95 kg with viscous and dry friction on a motor whose controller sees an encoder of coarse steps."""
    fine, n = 20, reference.size
    h = 1.0 / rate / fine
    x, v, z, seen = 0.0, 0.0, 0.0, 0.0
    xs, fs = np.empty(n), np.empty(n)
    for j in range(n):
        was, seen = seen, np.round(x / step) * step
        u = 1.7e5 * (reference[j] - seen) + 4300.0 * (speed[j] - (seen - was) * rate)
        xs[j], fs[j] = seen, u
        for _ in range(fine):
            friction = 1e6 * z + 5.0 * (v - 1e6 * abs(v) * z / 20.0)
            z += h * (v - 1e6 * abs(v) * z / 20.0)
            v += h * (u - 200.0 * v - friction - 3.0) / 95.0
            x += h * v
    return xs, fs


def positioning(seed: int, seconds: int = 7, rate: float = 1000.0) -> Run:
    """From place to place in trapezoids of velocity, with a stop at each."""
    rng = np.random.default_rng(seed)
    speed, place = [], 0.0
    while sum(map(len, speed)) < seconds * rate:
        way, top = rng.uniform(0.0, 0.2) - place, rng.uniform(0.05, 0.13)
        ramp, level = int(rate * top / 0.4), max(int(rate * (abs(way) / top - top / 0.4)), 0)
        up = np.linspace(0.0, top, ramp)
        part = np.sign(way) * np.concatenate([up, np.full(level, top), up[::-1], np.zeros(120)])
        speed.append(part)
        place += float(np.sum(part)) / rate
    v = np.convolve(np.concatenate(speed)[: int(seconds * rate)], np.hanning(41) / 20.0, "same")
    x, force = slide(np.cumsum(v) / rate, v, rate, 1e-6)
    return captured(f"move {seed}", rate, x, force + 0.3 * rng.standard_normal(force.size))


def heavy(*extra: Element) -> Model:
    return Model(name="slide", elements=(element("viscous_damping", {"c": 250.0}), *extra,
                                         element("moving_mass", {"m": 80.0})))  # fmt: skip


def test_a_coarse_encoder_is_differentiated_as_far_as_its_own_steps_allow() -> None:
    record = record_from_run(positioning(1))
    assert record.band_hz is None  # the force has no say in it
    assert record.bandwidth_hz < 120.0
    friction = element("presliding_friction", {"sigma": 5e5, "f_c": 15.0})
    fitted = fit_records(heavy(friction, element("force_offset", {"F0": 1.0})), [compact(record)])
    mass = next(e for e in fitted.model.elements if e.name == "moving_mass")
    assert mass.value("m") == pytest.approx(95.0, rel=0.02)


@pytest.mark.parametrize(("tone", "rate"), [(15.037, 1000.0), (0.2013, 100.0)])
def test_a_force_with_memory_has_no_say_in_the_band_of_its_motion(tone: float, rate: float) -> None:
    rng, t = np.random.default_rng(4), np.arange(6000) / rate
    v = 4e-3 * 2 * np.pi * tone * np.cos(2 * np.pi * tone * t)
    x = 4e-3 * np.sin(2 * np.pi * tone * t) + 2e-7 * rng.standard_normal(t.size)
    memory = lfilter([1.0], [1.0, -np.exp(-2.0 * tone / rate)], np.tanh(20.0 * v / np.max(v)))
    forces = (500.0 * v, 30.0 * memory + 0.1 * rng.standard_normal(t.size))
    viscous, bush = (record_from_run(captured("free", rate, x, force)) for force in forces)
    assert viscous.period == bush.period == 0
    assert viscous.bandwidth_hz == bush.bandwidth_hz > tone
    assert np.array_equal(viscous.motion.v, bush.motion.v)
    assert np.std((bush.motion.v - v)[bush.window]) < 2e-3 * np.std(v)


@pytest.mark.slow
def test_friction_and_offset_of_a_machine_that_moves_from_place_to_place_are_named() -> None:
    found = explain(heavy(), [positioning(1)], [positioning(3)])
    dry = {"coulomb_friction", "stribeck_friction", "presliding_friction"}
    names = [e.element for e in found.effects]
    assert names.count("force_offset") == 1
    assert len(names) == 2
    assert dry & set(names)
    assert found.held_out.final < 1.1 * found.held_out.noise_floor < 0.3 * found.held_out.base_refitted


def test_what_is_at_rest_is_left_out_and_said() -> None:
    t = np.arange(4000) / 1000.0
    x = np.where(np.sin(np.pi * t / 2) > 0.0, np.sin(2 * np.pi * 2 * t) ** 3 * 0.01, 0.0)
    force = np.gradient(x, 1e-3) * 100.0 + 0.01 * np.random.default_rng(0).standard_normal(t.size)
    record = record_from_run(captured("stop and go", 1000.0, x, force))
    assert any("at rest" in note for note in record.notes)
    assert record.measured.size < 0.7 * x.size
    assert replace(record, notes=()).force.size == x.size


@numba.njit
def hysteretic(u: Floats, h: float) -> Floats:
    """The oscillator of Noël & Schoukens' benchmark (2016), by Heun's method over inputs at the steps."""
    y, v, z = 0.0, 0.0, 0.0
    out = np.empty(u.size)
    for j in range(u.size):
        out[j] = y
        a0, z0 = (u[j] - 10.0 * v - 5e4 * y - z) / 2.0, 5e4 * v - 1e3 * (0.8 * abs(v) * z - 1.1 * v * abs(z))
        y1, v1, z1 = y + h * v, v + h * a0, z + h * z0
        force = u[min(j + 1, u.size - 1)]
        a1, z1 = (force - 10.0 * v1 - 5e4 * y1 - z1) / 2.0, 5e4 * v1 - 1e3 * (0.8 * abs(v1) * z1 - 1.1 * v1 * abs(z1))
        y, v, z = y + 0.5 * h * (v + v1), v + 0.5 * h * (a0 + a1), z + 0.5 * h * (z0 + z1)
    return out


def shaken(seed: int, rms: float, noise: float = 0.0, n: int = 4096, fine: int = 32, rate: float = 750.0) -> Run:
    """Three settled periods of the oscillator under a random-phase multisine from 5 to 150 Hz, N rms."""
    rng = np.random.default_rng(seed)
    lines = np.arange(int(5.0 * n / rate), int(150.0 * n / rate))
    spectrum = np.zeros(n * fine // 2 + 1, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(lines.size))
    force = np.fft.irfft(spectrum, n * fine)
    force *= rms / np.std(force)
    y = hysteretic(np.tile(force, 5), 1.0 / rate / fine)[::fine][2 * n :]
    y = y + noise * np.std(y) * rng.standard_normal(y.size)
    return captured(f"shaken {seed}", rate, y, np.tile(force[::fine], 3), n)


def test_where_a_force_drives_the_machine_it_is_compared_up_to_its_own_last_line() -> None:
    record = record_from_run(shaken(1, 50.0))
    assert record.band_hz == pytest.approx(150.0, abs=0.5)
    assert record.bandwidth_hz > 300.0  # the motion goes on, and a mass makes force of it
    assert record_from_run(resonator(1, k3=0.0, periodic=True)[1][0]).band_hz is None


@pytest.mark.parametrize("periods", [2, 4])
def test_the_noise_of_a_force_in_its_own_band_is_the_share_of_it_that_lies_there(periods: int) -> None:
    run = shaken(1, 50.0)
    n = run.period_samples
    rng = np.random.default_rng(6)
    x = np.tile(run.channels["displacement"][:n], periods)
    force = np.tile(run.channels["force"][:n], periods) + rng.standard_normal(periods * n)
    record = record_from_run(captured("noisy", 750.0, x, force, n))
    assert record.band_hz == pytest.approx(150.0, abs=0.5)
    assert record.sigma == pytest.approx(np.sqrt(2.0 * 150.0 / 750.0), rel=0.1)


@pytest.mark.slow
def test_a_hysteresis_that_grows_with_its_stroke_is_named_on_an_oscillator_driven_by_a_force() -> None:
    base = Model(
        name="linear", elements=(element("viscous_damping", {"c": 13.0}), element("linear_stiffness", {"k": 6e4}),
                                 element("moving_mass", {"m": 1.7})))  # fmt: skip
    # Lines 0.73 Hz apart, the width of the resonance; a period of 5.5 s has the same name after three times the time,
    # and three runs to train on after four times.
    train, held = shaken(1, 50.0, 1e-3, n=1024), shaken(4, 50.0, 1e-3, n=1024)
    found = explain(base, [train], [held])
    assert [e.element for e in found.effects] == ["bouc_wen"]
    values = {p: v for p, (v, *_) in found.effects[0].parameters.items()}
    assert values["alpha"] == pytest.approx(5e4, rel=0.1)
    assert values["beta"] + values["gamma"] < 0.0
    assert found.held_out.final < 0.1 * found.held_out.base_refitted
