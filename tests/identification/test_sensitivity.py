"""Sensitivity: Garson's weights, the published ordering, Sobol's indices of a known function, what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification.compute import Serial, Threads, using
from identification.errors import DataError, ModelError
from identification.physical.literature import literature
from identification.studies.sensitivity import (
    Sensitivity,
    sensitivity,
    sensitivity_data,
    sensitivity_text,
    write_sensitivity,
)
from identification.studies.sensitivity.network import Samples, TanhNetwork, garson, trained_share

# The operating point of a study of an MR seat damper (2021): 10 mm, 4 Hz, 0.8 A; SI.
SEAT = literature("hyperbolic tangent", {
    "tanh_hysteresis.alpha": 1025.79, "tanh_hysteresis.beta": 18.43, "tanh_hysteresis.delta": 0.9715,
    "force_offset.F0": -104.55, "viscous_damping.c": 1830.0, "linear_stiffness.k": 2.5,
})  # fmt: skip
VARIED = (
    "tanh_hysteresis.alpha", "tanh_hysteresis.beta", "viscous_damping.c", "tanh_hysteresis.delta", "force_offset.F0",
    "linear_stiffness.k",
)  # fmt: skip
QUICK = Sensitivity(vary=VARIED, levels=(0.5, 1.0, 1.5), networks=2, base_samples=64)
# Table 2 of that study: weights from α, β, δ, F0, c0, k0 to each hidden node, and from it to the output.
PUBLISHED = np.array([
    [0.763677, 0.773383, -0.32296, -0.00167, 0.30149, 1.02e-05, -0.0150],
    [1.283121, 0.219759, 0.129862, -0.02544, 0.205786, -0.00162, 1.2876],
    [-0.7358, -0.14136, 0.100185, -1.36419, -0.20055, -0.00179, -0.2472],
    [0.934392, -0.144, -0.13751, -0.02174, 0.576572, 0.001714, 0.2388],
    [-4.48097, -0.57274, -0.00747, -0.0086, -1.42884, 0.002235, -0.1046],
    [-0.16682, 1.768808, -0.8945, -0.0096, 0.29989, -0.00044, 2.0922],
    [1.833262, -0.5778, -0.07458, -0.0066, 0.476606, -0.00023, -47.6325],
    [-0.82338, -0.69084, 0.310103, 0.000858, -0.30901, 8.14e-05, 49.2800],
    [0.869601, -0.31437, 0.343672, 0.009563, 0.28554, 0.000773, -8.8736],
    [-0.22652, -1.612, 1.686386, 0.019954, -0.19215, 0.009069, 0.1586],
])  # fmt: skip


def test_the_published_weights_give_the_published_order_though_not_its_percentages() -> None:
    shares = 100.0 * garson(PUBLISHED[:, :6], PUBLISHED[:, 6])
    assert list(np.argsort(-shares)) == [0, 1, 4, 2, 3, 5]
    assert shares == pytest.approx([49.1, 25.6, 9.8, 0.30, 15.1, 0.0105], rel=0.02)  # published: 39.4, 30.7, 14.7 …


def test_an_input_without_weights_has_no_share_and_shares_sum_to_one() -> None:
    shares = garson(np.array([[1.0, 0.0], [2.0, 0.0]]), np.array([1.0, -3.0]))
    assert shares == pytest.approx([1.0, 0.0])


def test_the_networks_gradient_is_that_of_its_output() -> None:
    network, random = TanhNetwork(3, 4), np.random.default_rng(2)
    samples = Samples(random.uniform(-1, 1, (30, 3)), random.uniform(-1, 1, 30))
    weights = network.first(random)
    force, h = network.simulate(weights, samples), 1e-6
    slope = network.sums(weights, samples, force).slope
    numbers = [
        -(network.squares(weights + step, samples) - network.squares(weights - step, samples)) / (4 * h)
        for step in h * np.eye(network.size)
    ]
    assert slope == pytest.approx(numbers, rel=1e-4, abs=1e-6)


def test_a_network_gives_most_share_to_the_input_that_matters_most() -> None:
    random = np.random.default_rng(0)
    inputs = random.uniform(-1, 1, (400, 2))
    outputs = np.tanh(2.0 * inputs[:, 0]) + 0.1 * inputs[:, 1]
    samples = Samples(inputs[:300], outputs[:300])
    found = trained_share(samples, Samples(inputs[300:], outputs[300:]), (-1.0, 1.0), 4, 1)
    assert found.shares[0] > 0.5


def test_the_order_of_the_study_is_found_on_the_tanh_model() -> None:
    found = sensitivity(SEAT, QUICK)
    assert found.order("one at a time") == list(VARIED)
    assert set(found.order("Garson, network")[:2]) == set(VARIED[:2])
    assert found.order("Garson, network")[4:] == list(VARIED[4:])
    assert found.changes.size == 3**6


def test_the_answer_is_the_same_on_every_executor_and_after_an_interruption(tmp_path: Path) -> None:
    asked = replace(QUICK, vary=VARIED[:3], levels=(0.5, 0.75, 1.0, 1.25, 1.5), networks=1)

    def interrupt(done: float, text: str) -> None:
        if done > 0.5:
            raise KeyboardInterrupt

    with using(Serial()):
        one = sensitivity_data(sensitivity(SEAT, asked))
        with pytest.raises(KeyboardInterrupt):
            sensitivity(SEAT, asked, tell=interrupt, journal=tmp_path / "part")
    with using(threads := Threads(2)):
        two = sensitivity_data(sensitivity(SEAT, asked, journal=tmp_path / "part"))
    threads.close()
    assert one == two
    assert not list(tmp_path.iterdir())


def test_the_page_says_where_garson_misleads(tmp_path: Path) -> None:
    found = sensitivity(SEAT, replace(QUICK, vary=VARIED[:3]))
    write_sensitivity(tmp_path / "page.html", found)
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "count as influence" in text
    assert "tanh_hysteresis.alpha" in text
    assert "cancel between nodes" in sensitivity_text(found)


def test_bad_input_is_named_before_the_work_starts() -> None:
    with pytest.raises(ModelError, match="has no parameter 'k9'"):
        sensitivity(SEAT, replace(QUICK, vary=("k9", VARIED[0])))
    with pytest.raises(ModelError, match="is 0 in the model"):
        sensitivity(SEAT, replace(QUICK, vary=("viscous_damping.c_control", VARIED[0])))
    with pytest.raises(ModelError, match="more than 100000"):
        sensitivity(SEAT, replace(QUICK, levels=tuple(np.linspace(0.5, 1.5, 9))))
    with pytest.raises(ModelError, match="1 parameters vary"):
        sensitivity(SEAT, replace(QUICK, vary=VARIED[:1]))
    with pytest.raises(DataError, match="levels are"):
        Sensitivity(levels=(1.0, 1.0))
    with pytest.raises(DataError, match="base_samples is 100"):
        Sensitivity(base_samples=100)
