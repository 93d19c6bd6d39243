"""A system whose map from one sample to the next is known: the networks find that map, not only its output."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.blackbox import BlackBox, Structure, identify, regressors
from identification.blackbox.network import network
from identification.blackbox.preparation import course_of
from identification.blackbox.samples import samples_of
from rigctl.runfile import Run

Floats = NDArray[np.float64]
RATE_HZ, SIZE_N, SPEED = 200.0, 300.0, 0.25
_BEFORE = 100  # samples


def one_step(before: Floats, v: Floats, last: Floats) -> Floats:
    """F(t) of F(t − 1), v(t) and v(t − 1), N: a bend in the speed, and one in what is fed back."""
    fed = 0.55 * before - 0.2 * SIZE_N * np.tanh(before / SIZE_N)
    return np.asarray(fed + SIZE_N * np.tanh(v / 0.12) + 200.0 * last)


def run_of(seed: int, samples: int = 1500) -> Run:
    """A run that was in motion before its first sample."""
    rng, t = np.random.default_rng([5, seed]), np.arange(-_BEFORE, samples) / RATE_HZ
    hertz, phase = rng.uniform(0.3, 6.0, 20), rng.uniform(0.0, 6.3, 20)
    turns = np.multiply.outer(t, 2.0 * np.pi * hertz) + phase
    v = SPEED / np.sqrt(10.0) * np.cos(turns) @ np.ones(20)
    x = SPEED / np.sqrt(10.0) * np.sin(turns) @ (1.0 / (2.0 * np.pi * hertz))
    force = np.zeros(t.size)
    for k in range(1, t.size):
        force[k] = one_step(force[k - 1], v[k], v[k - 1])
    force += 0.5 * rng.standard_normal(t.size)
    channels = {name: one[_BEFORE:].copy() for name, one in (("displacement", x), ("velocity", v), ("force", force))}
    return Run(
        run_id=f"known-{seed}", created="2026-01-01T00:00:00+00:00", specimen="known", sample_rate_hz=RATE_HZ,
        period_samples=0, excitation_kind="custom", status="complete", channels=channels,
        units={"displacement": "m", "velocity": "m/s", "force": "N"},
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["narx", "nnoe"])
def test_a_network_recovers_the_map_of_a_known_system(kind: str) -> None:
    structure, shown = Structure(regressors("F1 v0 v1"), 8), run_of(2)
    found = identify(kind, [run_of(1)], held_out=[shown], structures=[structure])
    assert found.shown["known-2"] > 99.0
    assert found.predicted == pytest.approx(found.shown["known-2"], abs=1.0)
    model = found.model
    assert isinstance(model, BlackBox)
    course, scale = course_of(shown, ("velocity",)), model.scales["force"]
    samples = samples_of([course], structure, model.scales)
    member = model.members[0]
    given = network(structure, model.scales).simulate(member.weights, samples, 1)[-shown.samples :]
    v = shown.channels["velocity"]
    true = one_step(shown.channels["force"][:-1], v[1:], v[:-1])
    error = given[1:] * scale.size + scale.centre - true
    assert np.sqrt(np.mean(error**2)) < 0.015 * np.std(true)
