"""A damper and its rig for the tests: other curves and another integrator than those of the solver under test."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.discrepancy import naming
from identification.discrepancy.excess import excess_of
from identification.discrepancy.trials import trial_of
from identification.fitting.leastsquares import fit_records
from identification.physical.model import Model, element
from identification.record import Record, compact, record_from_run
from rigctl.runfile import Run

FS = 1000.0
FINE = 8
Floats = NDArray[np.float64]

AS_SIMULATED = Model(
    name="as simulated today",
    elements=(
        element("valve_damping", {"c_soft": 900, "c_firm": 2100, "u_soft": 0.3, "u_firm": 1.6, "w_knee": 0.6}),
        element("tanh_hysteresis", {"alpha": 50, "alpha_control": 0, "beta": 40, "delta": 0.0}, ("delta",)),
    ),
)


def multisine(period: int, low_hz: float, high_hz: float, peak: float, seed: int, corner_hz: float = 2.0) -> Floats:
    """One period of a random-phase multisine on the fine grid, (period · FINE,)."""
    rng = np.random.default_rng(seed)
    lines = np.arange(max(1, int(np.ceil(low_hz * period / FS))), int(high_hz * period / FS))
    spectrum = np.zeros(period * FINE // 2 + 1, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * rng.uniform(size=lines.size)) / (1 + (lines * FS / period / corner_hz) ** 2)
    x = np.fft.irfft(spectrum, period * FINE)
    return x * peak / np.max(np.abs(x))


def derivative(x: Floats) -> Floats:
    """Exact derivative of a periodic fine-grid signal, (N,)."""
    omega = 2 * np.pi * np.fft.rfftfreq(x.size, 1 / (FS * FINE))
    return np.fft.irfft(1j * omega * np.fft.rfft(x), x.size)


def base_force(v: Floats, i: Floats) -> Floats:
    """A valve that softens with speed and a small smooth friction, N."""
    opening = 700.0 + 1500.0 * (i - 0.3)
    return opening * v / (1 + np.abs(v / 0.45) ** 1.6) ** (1 / 1.6) + 70.0 * np.tanh(28.0 * v)


def effect_force(effect: str, x: Floats, v: Floats, a: Floats, force: Floats) -> Floats:
    """The force with one hidden effect, in a form other than the catalogue's, (N,)."""
    if effect == "coulomb_friction":
        return force + 45.0 * v / (np.abs(v) + 2e-4)
    if effect == "linear_stiffness":
        return force + 2500.0 * x * (1 + 0.02 * np.abs(x) / 0.03)
    if effect == "damping_asymmetry":
        return force + 90.0 * np.sqrt(v**2 + 1e-6)
    if effect == "moving_mass":
        return force + 2.5 * a
    if effect == "force_delay":
        return np.roll(force, round(2.25e-3 * FS * FINE))
    if effect == "end_stop":
        return force + 6e4 * np.sign(x) * np.maximum(np.abs(x) - 0.02, 0.0) ** 1.02
    if effect == "two_frictions":
        return force + (25.0 + 20.0 / (1 + (v / 0.03) ** 2)) * v / (np.abs(v) + 2e-4) + 20.0 * np.tanh(v / 0.01)
    if effect == "cogging":  # not in the catalogue
        return force + 40.0 * np.sin(2 * np.pi * x / 0.004)
    assert effect == "none"
    return force


def run(effect: str, index: int, seed: int, *, noise: float = 3.0, scale: float = 1.0) -> Run:
    """One measured run: multisines, sines and a triangle; forces `scale` times those of the specimen."""
    rng = np.random.default_rng([seed, index])
    kind = ("multisine", "multisine", "sine", "sine", "triangle", "multisine")[index % 6]
    period, count = {"multisine": (4096, 4), "sine": (500, 16), "triangle": (4000, 3)}[kind]
    if kind == "multisine":
        x = multisine(period, 0.25, 20.0, (0.03, 0.018, 0.025)[index % 3], 100 * seed + index)
        i = 0.95 + multisine(period, 0.25, 15.0, 0.6, 500 + 100 * seed + index, corner_hz=10.0)
    else:
        turn = 2 * np.pi * np.arange(period * FINE) / (period * FINE)
        x = (
            (0.012 * np.sin(turn))
            if kind == "sine"
            else 0.028 * (np.sin(turn) - np.sin(3 * turn) / 9 + np.sin(5 * turn) / 25)
        )
        i = np.full(x.size, (0.5, 1.3)[index % 2])
    v = derivative(x)
    force = scale * effect_force(effect, x, v, derivative(v), base_force(v, i))
    repeat = lambda s: np.tile(s[::FINE], count)  # noqa: E731
    n = period * count
    channels = {
        "displacement": repeat(x) + 3e-6 * rng.standard_normal(n),
        "force": repeat(force) + scale * noise * rng.standard_normal(n),
        "current": repeat(i) + 1e-3 * rng.standard_normal(n),
    }
    return Run(
        run_id=f"{effect}-{seed}-{index}", created="2026-01-01T00:00:00+00:00", specimen="specimen",
        sample_rate_hz=FS, period_samples=period, excitation_kind=kind, status="complete", channels=channels,
        units={"displacement": "m", "force": "N", "current": "A"}, design=None, events=(), path=None,
    )  # fmt: skip


def between_samples(periodic: Run) -> Run:
    """The run as a recorder sees it whose clock has nothing to do with the rig's: it repeats between two samples."""
    at = 1.0007 * np.arange(int(periodic.samples / 1.0007))
    read = {name: np.interp(at, np.arange(periodic.samples), y) for name, y in periodic.channels.items()}
    return replace(periodic, period_samples=0, channels=read)


def campaign(effect: str, seed: int, **more: float) -> tuple[list[Run], list[Run]]:
    """Five training runs and two held-out ones."""
    runs = [run(effect, k, seed, **more) for k in range(5)]
    return runs, [run(effect, 5, seed, **more), run(effect, 8, seed, **more)]


def records_with(effect: str) -> list[Record]:
    """A multisine and others, ready to be fitted."""
    return [compact(record_from_run(run(effect, k, seed=3))) for k in (0, 1, 2, 4)]


def found_with(*names: str, records: list[Record]) -> naming.Search:
    """What a search that ends with these names stands on, each compared with nothing else."""
    first = {"linear_stiffness": {"k": 2000.0}, "moving_mass": {"m": 0.1}, "force_offset": {"F0": -50.0},
             "coulomb_friction": {"f_c": 30.0}, "end_stop": {"k": 5e4, "z_max": 0.021}}  # fmt: skip
    model = AS_SIMULATED
    for name in names:
        model = model.with_element(element(name, first[name]))
    fit = fit_records(model, records)
    compared = {}
    for name in names:
        rest = fit_records(fit.model.without(name), records)
        own = trial_of(fit, name, rest, records, screened=1.0)
        beside = tuple(n for n in names if n != name)
        compared[name] = naming.Compared(without=rest, start=rest, beside=beside, rivals=(own,))
    base = fit_records(AS_SIMULATED, records)
    return naming.Search(
        fit=fit, names=names, excess=excess_of(fit), given=AS_SIMULATED, base_excess=excess_of(base), compared=compared
    )
