"""Fits: recovery, robustness, uncertainty that holds, and refusals before any work."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks.hidden.case import case
from identification.errors import DataError, SimulationError
from identification.fitting import fit, fit_from_many, fit_records, profile, warnings
from identification.fitting.discretisation import with_solver_error
from identification.fitting.frogs import frog_leaping
from identification.fitting.leastsquares import inverse_gram
from identification.models.motion import Motion
from identification.physical.literature import literature
from identification.physical.model import Model, element
from identification.physical.modelfile import model_from_json
from identification.physical.simulate import simulate
from identification.record import Record, is_off, is_steady, record_from_run
from rigctl.runfile import Run, with_channel
from tests.identification.gradients import freed
from tests.identification.specimens import between_samples, run

SIGMA = 2.0


def recorded(model: Model, name: str = "r", *, frequency: float = 1.7, seed: int = 0, current: float = 0.0) -> Record:
    """A record of the model itself under two sines, with white noise: for the statistics of a fit alone."""
    n, dt = 3000, 1e-3
    t = np.arange(n) * dt
    x, v, a = np.zeros(n), np.zeros(n), np.zeros(n)
    for amplitude, f in ((0.012, frequency), (0.004, 3.3 * frequency)):
        w = 2 * np.pi * f
        x, v, a = x + amplitude * np.sin(w * t), v + amplitude * w * np.cos(w * t), a - amplitude * w**2 * np.sin(w * t)
    motion = Motion(dt=dt, x=x, v=v, a=a, i=np.full(n, current), temperature=np.full(n, 25.0), t=t)
    force = simulate(model, motion).force + SIGMA * np.random.default_rng(seed).standard_normal(n)
    return Record(
        name=name, motion=motion, force=force, window=slice(0, n), period=0, sigma=SIGMA, has_current=current != 0.0,
        has_temperature=False, route="made", bandwidth_hz=20.0,
    )  # fmt: skip


TRUE = Model(
    name="m",
    elements=(
        element("viscous_damping", {"c": 900.0}),
        element("tanh_hysteresis", {"alpha": 200.0, "beta": 30.0, "delta": 0.3}),
        element("linear_stiffness", {"k": 2500.0}),
    ),
)


STIFF = Model(
    name="s",
    elements=(
        element("valve_damping", {"c_soft": 900.0, "c_firm": 2100.0, "u_soft": 0.3, "u_firm": 1.6, "w_knee": 0.1}),
        element("series_compliance", {"k": 1e5, "c": 0.0}, ("c",)),
    ),
)


def every(record: Record, step: int) -> Record:
    """Each step-th sample of a record."""
    names = ("x", "v", "a", "i", "temperature", "t")
    series = {name: getattr(record.motion, name)[::step].copy() for name in names}
    motion = replace(record.motion, dt=step * record.motion.dt, **series)
    force = record.force[::step].copy()
    return replace(record, motion=motion, force=force, window=slice(0, force.size))


def quiet(record: Record) -> Record:
    """The record with a hundredth of its noise."""
    noise = SIGMA * np.random.default_rng(0).standard_normal(record.force.size)
    return replace(record, force=record.force - 0.99 * noise, sigma=0.01 * SIGMA)


@pytest.mark.parametrize("seed", [0, 3])
def test_from_thirty_percent_off_the_fit_of_a_null_specimen_reaches_the_noise(seed: int) -> None:
    hidden = case(seed, "null")
    model = model_from_json(hidden.base_model)
    values, free = model.values(), model.free()
    rng = np.random.default_rng(seed)
    low, high = model.bounds()
    off = values * np.where(free, 1.0 + 0.3 * rng.choice([-1.0, 1.0], values.size), 1.0)
    found = fit(model.with_values(np.clip(off, low, high)), hidden.runs)
    assert found.converged
    assert found.rms < 1.05 * hidden.noise_n


def test_the_stated_deviation_is_that_of_repeated_experiments() -> None:
    fits = [fit_records(TRUE, [recorded(TRUE, seed=s)]) for s in range(24)]
    values = np.array([f.model.values()[f.model.free()] for f in fits])
    stated = np.mean([np.sqrt(np.diag(f.covariance)) for f in fits], axis=0)
    assert values.std(axis=0, ddof=1) == pytest.approx(stated, rel=0.5)
    assert np.all(np.abs(values.mean(axis=0) - TRUE.values()[TRUE.free()]) < 4 * stated / np.sqrt(24))


def remembering(seed: int, name: str = "r", frequency: float = 1.7) -> Record:
    """The same with noise that remembers 50 samples, as a filter in the load cell's amplifier makes it."""
    record, pole = recorded(TRUE, name, seed=seed, frequency=frequency), 0.98
    white = np.random.default_rng(seed).standard_normal(record.force.size)
    noise = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], white)
    return replace(record, force=record.force + SIGMA * (noise - white))


@pytest.mark.parametrize("frequencies", [(1.7,), (1.7, 0.9, 2.3, 3.1)])
def test_the_stated_deviation_holds_where_the_noise_remembers(frequencies: tuple[float, ...]) -> None:
    true, free = TRUE.values(), TRUE.free()
    inside = []
    for seed in range(40):
        records = [remembering(100 * seed + k, str(k), f) for k, f in enumerate(frequencies)]
        found = fit_records(TRUE, records)
        inside.append(np.abs(found.model.values() - true)[free] < 1.96 * np.sqrt(np.diag(found.covariance)))
    assert np.mean(inside) > 0.88  # it was 0.3 to 0.4


def test_the_stated_deviation_holds_what_the_solver_does_at_a_coarse_step() -> None:
    fine = quiet(recorded(STIFF, frequency=6.0))
    coarse = every(fine, 10)
    found = fit_records(STIFF, [coarse])
    wider = with_solver_error(found, [coarse])
    off = np.abs(found.model.values() - STIFF.values())[STIFF.free()]
    before, after = (np.sqrt(np.diag(f.covariance)) for f in (found, wider))
    assert np.any(off > 4.0 * before)
    assert np.all(off < 3.0 * after)
    noisy = recorded(STIFF, frequency=6.0)
    plain = fit_records(STIFF, [noisy])
    again = with_solver_error(plain, [noisy])  # where the noise hides the solver's error, nothing is wider
    assert np.sqrt(np.diag(again.covariance)) == pytest.approx(np.sqrt(np.diag(plain.covariance)), rel=0.05)


def test_what_the_data_hardly_see_has_a_huge_deviation_and_a_finite_one() -> None:
    variances = np.diag(inverse_gram(np.diag([1e-310, 1e-190, 4.0])))
    assert np.all(np.isfinite(variances))
    assert variances[:2].min() > 1e11
    assert variances[2] == pytest.approx(0.25)


def test_the_profile_of_a_well_seen_parameter_is_its_deviation() -> None:
    record = recorded(TRUE)
    found = fit_records(TRUE, [record])
    index = found.model.names().index("linear_stiffness.k")
    e, k = list(found.model.slots())[index]
    std = e.parameters[k].std
    assert std is not None
    low, high = profile(found, [record], "linear_stiffness.k").interval
    assert (high - low) / 2 == pytest.approx(std, rel=0.1)
    with pytest.raises(DataError, match="was not fitted"):
        profile(found, [record], "force_offset.F0")


def test_outliers_move_a_robust_fit_far_less() -> None:
    record = recorded(TRUE)
    force = record.force.copy()
    force[::37] += 400.0
    spoilt = replace(record, force=force)
    plain, robust = (fit_records(TRUE, [spoilt], robust=c) for c in (None, 2.0))
    free = TRUE.free()
    off = [np.linalg.norm(f.model.values()[free] / TRUE.values()[free] - 1.0) for f in (plain, robust)]
    assert off[1] < 0.2 * off[0]


def test_many_starts_find_the_valley_that_one_misses() -> None:
    record = recorded(TRUE)
    low, high = TRUE.bounds()
    factors = np.array([{"beta": 60.0, "alpha": 8.0, "delta": 6.0}.get(n.split(".")[1], 1.0) for n in TRUE.names()])
    far = TRUE.with_values(np.clip(TRUE.values() * factors, low, high))
    many = fit_from_many(far, [record], 12, spread=30.0, seed=1)
    assert many.best.rms < 1.02 * SIGMA
    assert len(many.costs) == 12
    assert 1 <= many.met <= 12


def test_parameters_that_trade_are_named_with_the_test_that_would_part_them() -> None:
    model = Model(
        name="m",
        elements=(
            element("viscous_damping", {"c": 900.0}),
            element("linear_stiffness", {"k": 2500.0}),
            element("moving_mass", {"m": 5.0}),
        ),
    )
    n, w = 2000, 2 * np.pi * 2.0
    base = recorded(model)
    t = base.motion.t[:n]
    x, v = 0.01 * np.sin(w * t), 0.01 * w * np.cos(w * t)
    motion = replace(base.motion.head(n), x=x, v=v, a=-w * w * x)
    noise = np.random.default_rng(1).standard_normal(n)
    record = replace(base, motion=motion, force=simulate(model, motion).force + noise, window=slice(0, n))
    said = warnings(fit_records(model, [record]))
    assert any(
        "cannot separate linear_stiffness.k from moving_mass.m" in s and "another frequency" in s for s in said
    ), said
    assert warnings(fit_records(model, [recorded(model)])) == []


def sine_run(index: int = 2) -> Run:
    return run("none", index, 1)


def test_twelve_free_parameters_on_one_sine_are_refused_by_name() -> None:
    model = literature("modified hyperbolic tangent")
    free = Model(name="thirteen", elements=tuple(
        freed(e) if e.name != "modulated_tanh_hysteresis" else
        replace(e, parameters=tuple(replace(p, fixed=k == 1) for k, p in enumerate(e.parameters)))
        for e in model.elements
    ))  # fmt: skip
    with pytest.raises(DataError, match=r"12 free parameters .*modulated_tanh_hysteresis\.alpha1.* on 1 sine"):
        fit(free, [sine_run()])


@pytest.mark.parametrize("noise_a", [5e-7, 5e-4, 0.5])
def test_a_current_that_is_switched_off_is_one_condition_whatever_its_sensor_shows(noise_a: float) -> None:
    model, rng = literature("modified hyperbolic tangent"), np.random.default_rng(1)
    runs = [sine_run(), sine_run()]
    runs = [with_channel(r, "current", noise_a * rng.standard_normal(r.samples), "A") for r in runs]
    with pytest.raises(DataError, match=r"free parameters .* on 1 sine:"):
        fit(model, runs)
    assert "between the harmonics" in record_from_run(between_samples(runs[0])).route


@pytest.mark.parametrize("swing_a", [1e-6, 1.0])
def test_a_current_that_swings_is_not_steady_however_small(swing_a: float) -> None:
    swing = swing_a * np.sin(np.arange(2000) / 50.0)
    assert not is_steady(swing)
    assert is_steady(swing + 100.0 * swing_a)
    assert not is_off(swing + 100.0 * swing_a)


def test_what_cannot_work_is_refused_before_any_work() -> None:
    held = Model(name="held", elements=(element("viscous_damping", {"c": 1.0}, ("c", "c_control")),))
    with pytest.raises(DataError, match="'held' has no free parameter"):
        fit(held, [sine_run()])
    with pytest.raises(DataError, match="starts is 0"):
        fit(TRUE, [sine_run()], starts=0)
    with pytest.raises(DataError, match="robust is -1"):
        fit(TRUE, [sine_run()], robust=-1.0)


def test_a_run_without_the_current_that_a_gain_needs_is_refused() -> None:
    measured = sine_run()
    passive = replace(measured, channels={k: v for k, v in measured.channels.items() if k != "current"})
    lagged = TRUE.with_element(element("control_lag", {"tau": 0.01}))
    with pytest.raises(DataError, match="has no control current, which 'control_lag' needs"):
        fit(lagged, [passive])


def test_a_run_at_zero_current_has_one_and_a_gain_needs_the_channel() -> None:
    measured = sine_run()
    zero = replace(measured, channels={**measured.channels, "current": np.zeros(measured.samples)})
    lagged = TRUE.with_element(element("control_lag", {"tau": 0.01}))
    assert fit(lagged, [zero]).rms > 0
    passive = replace(measured, channels={k: v for k, v in measured.channels.items() if k != "current"})
    gain = Model(name="m", elements=(element("viscous_damping", {"c": 900.0, "c_control": 50.0}),))
    with pytest.raises(DataError, match="has no control current, which 'viscous_damping' needs"):
        fit(gain, [passive])


def test_a_search_that_ends_early_is_a_result_with_its_reason() -> None:
    found = fit_records(TRUE.with_values(TRUE.values() * 1.5), [recorded(TRUE)], max_iterations=1)
    assert not found.converged
    assert found.reason == "the iteration limit was reached"


def test_a_fit_does_not_begin_where_the_force_is_larger_than_any_machines() -> None:
    away = Model(name="runaway", elements=(element("viscous_damping", {"c": 1e15}),))
    with pytest.raises(SimulationError, match="'runaway' runs away on"):
        fit_records(away, [recorded(TRUE)])


def test_the_noise_floor_is_met_with_the_records_of_a_real_run() -> None:
    assert record_from_run(sine_run()).sigma == pytest.approx(3.0, rel=0.1)


def test_leaping_frogs_find_the_bottom_of_a_tilted_bowl_and_the_same_one_again() -> None:
    low, high = np.full(4, -2.0), np.full(4, 2.0)

    def bowl(p: np.ndarray) -> float:
        return float(np.sum(np.arange(1, 5) * (p - 0.3) ** 2) + 0.5 * p[0] * p[1] - 0.045)

    found = frog_leaping(bowl, low, high, evaluations=4000, seed=4)
    assert np.linalg.norm(found.place[2:] - 0.3) < 0.05
    assert 4000 <= found.evaluations < 4200
    assert frog_leaping(bowl, low, high, evaluations=4000, seed=4).cost == found.cost


def test_a_hysteresis_that_turns_over_gently_meets_the_noise_once_the_fit_may_say_so() -> None:
    hidden = case(38, "null")
    canonical = fit(model_from_json(hidden.base_model), hidden.runs)
    refined = fit(model_from_json(hidden.base_model), hidden.runs, refine=True)
    assert canonical.rms > 1.5 * hidden.noise_n
    assert refined.rms < 1.05 * hidden.noise_n
    assert any(e.spec.parameters[k].name == "z_r" and e.parameters[k].value > 0 for e, k in refined.model.slots())
