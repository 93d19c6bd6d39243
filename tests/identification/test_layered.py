"""Layered NARX networks: their gradient, their free run, their file, and the evolution before their training."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identification.blackbox import Layers, Structure, identify, layers_asked, regressors
from identification.blackbox.activations import ACTIVATIONS
from identification.blackbox.evolution import POPULATION, evolve
from identification.blackbox.given import given as given_runs
from identification.blackbox.layered import LayeredNarx
from identification.blackbox.layered_training import (
    Layered,
    layered,
    squares_on,
    train_layered,
    trained_best,
    usual_beside,
)
from identification.blackbox.layers import Predictor, Rows, first_layer_weights, rows_of
from identification.blackbox.networks import scales_for
from identification.blackbox.samples import course_along, samples_of
from identification.blackbox.scaling import Scale
from identification.blackbox.writing import write_identified
from identification.errors import DataError, ModelError
from identification.models import load_model
from identification.models.simulation import checked_motion
from tests.identification.hysteretic import hysteretic

SMOOTH = [name for name in ACTIVATIONS if name != "satlins"]  # whose slope jumps
UNIT = Scale(0.0, 1.0, -2.0, 2.0)


def a_network(layers: Layers, seed: int = 1) -> LayeredNarx:
    structure = Structure(regressors("F1 F2 v0 v1"), 0)
    weights = 2.0 * first_layer_weights(layers, 4, seed)
    return LayeredNarx(
        name="n", dt=0.005, scales={"force": Scale(3.0, 100.0, -200.0, 200.0), "velocity": Scale(0.0, 0.1, -0.3, 0.3)},
        structure=structure, layers=layers, weights=weights,
    )  # fmt: skip


@settings(max_examples=25, deadline=None)
@given(
    nodes=st.lists(st.integers(1, 5), min_size=1, max_size=3),
    hidden=st.sampled_from(SMOOTH),
    output=st.sampled_from(SMOOTH),
    seed=st.integers(0, 1000),
)
def test_the_gradient_is_the_slope_of_the_prediction(nodes: list[int], hidden: str, output: str, seed: int) -> None:
    layers, rng = Layers(tuple(nodes), hidden, output), np.random.default_rng(seed)
    predictor = Predictor(layers, 3, (0.2, 1.7))
    weights, rows = first_layer_weights(layers, 3, seed), Rows(rng.standard_normal((7, 3)), rng.standard_normal(7))
    found = predictor.gradient(weights, rows.phi)
    for k in range(weights.size):
        step = np.zeros(weights.size)
        step[k] = 1e-6
        slope = (predictor.simulate(weights + step, rows) - predictor.simulate(weights - step, rows)) / 2e-6
        np.testing.assert_allclose(found[:, k], slope, atol=1e-7)
    sums = predictor.sums(weights, rows, predictor.simulate(weights, rows))
    np.testing.assert_allclose(sums.gram, found.T @ found, atol=1e-9)


@pytest.mark.parametrize("hidden", ACTIVATIONS)
@pytest.mark.parametrize("nodes", [(3,), (4, 2), (2, 5, 3)])
def test_a_free_run_is_the_prediction_fed_with_its_own_past(hidden: str, nodes: tuple[int, ...]) -> None:
    model = a_network(Layers(nodes, hidden, "tansig"))
    course = course_along(checked_motion(model, hysteretic(1, 300)))
    force = model.along(course)
    samples, scale = samples_of([course], model.structure, model.scales), model.scales["force"]
    samples.force[-300:] = (force - scale.centre) / scale.size
    rows = rows_of(samples, model.structure.fed_back)
    predicted = Predictor(model.layers, 4, (-0.03, 2.0)).simulate(model.weights, rows)
    cut = np.clip(predicted, *scale.edges)
    np.testing.assert_allclose(cut[2:], samples.force[-298:], rtol=1e-9, atol=1e-9)


def test_evolution_never_loses_its_best_and_the_same_seed_gives_the_same() -> None:
    rng = np.random.default_rng(3)
    phi = rng.standard_normal((200, 2))
    rows = Rows(phi, np.tanh(phi[:, 0] - phi[:, 1]))
    one = evolve(Layers((3,)), (0.0, 1.0), rows, seed=1, iterations=12)
    other = evolve(Layers((3,)), (0.0, 1.0), rows, seed=1, iterations=12)
    assert np.all(np.diff(one.best) <= 0.0)
    assert np.all(one.worst >= one.best)
    assert (one.best.size, len(one.hidden), POPULATION) == (13, 13, 40)
    assert one.gain > 0.0
    assert np.array_equal(one.weights, other.weights)
    assert one.layers.hidden in ACTIVATIONS
    fitness = np.sqrt(np.mean((rows.force - Predictor(one.layers, 2, (0.0, 1.0)).simulate(one.weights, rows)) ** 2))
    assert fitness == pytest.approx(one.best[-1])


def test_what_an_evolution_chose_for_untrained_networks_does_not_bind_the_training() -> None:
    """Here it chose an output within ±1 of the span, and most of the force lies at the ends of that."""
    phi = np.random.default_rng(4).standard_normal((600, 2))
    rows, span = Rows(phi, np.clip(3.0 * phi[:, 0] - phi[:, 1], -1.0, 1.0)), (0.0, 1.0)
    evolved = Layers((5,), "purelin", "logsig")
    assert usual_beside(Layers((5,))) == [Layers((5,))]
    assert usual_beside(evolved)[0] == evolved
    weights = first_layer_weights(evolved, 2, 1)
    layers, best = trained_best(usual_beside(evolved), weights, rows, 2, span, 0.02)
    _, alone = trained_best([evolved], weights, rows, 2, span, 0.02)
    assert (layers.hidden, layers.output) != ("purelin", "logsig")
    assert best.error < 0.1 * alone.error


def test_a_layered_network_is_identified_and_comes_back_from_its_file(tmp_path: Path) -> None:
    structures = [Structure(regressors("F1 F2 v0 v1"), 0)]
    runs = [hysteretic(k, 900) for k in (1, 2)]
    found = identify("narx", runs[:1], held_out=runs[1:], structures=structures, layers=Layers((6, 3)))
    assert found.shown["hysteretic-2"] > 80.0
    assert found.predicted > 80.0
    assert 0.5 < found.coverage <= 1.0
    write_identified(tmp_path / "n.json", found.model)
    again = load_model(tmp_path / "n.json")
    motion = checked_motion(again, runs[1])
    assert (again.kind, np.array_equal(again.force(motion), found.model.force(motion))) == ("layered", True)


def test_of_several_starts_the_one_is_kept_whose_free_run_on_the_training_is_nearest() -> None:
    structure, run = Structure(regressors("F1 F2 v0 v1"), 0), hysteretic(3, 600)
    taken = given_runs("narx", [run], structures=[structure], layers=Layers((5, 3)))
    scales = scales_for(taken.courses, [structure])
    found, judged, _ = layered([Layered(structure, Layers((5, 3)), 0.002)], taken.courses, lambda done, text: None)
    one = judged[0].candidate
    assert isinstance(one, Layered)
    each = [train_layered(one, taken.courses, scales, seed=seed) for seed in (1, 2, 3)]
    errors = [squares_on(model, taken.courses) for model in (found, *each)]
    assert errors[0] <= min(errors)
    assert errors[0] < max(errors)


def test_an_evolution_is_judged_beside_random_weights_and_kept_where_it_is_better() -> None:
    structures = [Structure(regressors("v0 a0"), 0)]
    runs = [hysteretic(1, 900)]
    plain = identify("mlp", runs, structures=structures, layers=Layers((3,)))
    found = identify("mlp", runs, structures=structures, evolved=True, layers=Layers((3,)))
    said = [str(one.candidate) for one in found.judged]
    assert sum("evolved" in one for one in said) == 1
    assert found.predicted >= plain.predicted
    facts = found.model.facts
    assert ("evolved" in said[0]) == ("fitness_last" in facts)
    assert facts.get("fitness_last", 0.0) < facts.get("fitness_first", 1.0)


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (("activations", 0), "relu", "activation is 'relu'"),
        (("activations",), ["tansig"], "activations must be two names"),
        (("layers",), [], "layers must be a list of 2"),
        (("layers", 0, "biases"), [1.0], "layers[0].weights must be a list of 1 rows"),
        (("layers", 0, "weights", 0), [1.0], "layers[0].weights[0] must be a list of 4 numbers"),
        (("layers", 0, "weights", 0, 0), "x", "must be a finite number"),
        (("regressors",), ["F1"], "must be a list of 1 numbers"),
        (("regressors",), ["v0", "F1", "F2", "v1"], "must be in the order F1 F2 v0 v1"),
        (("signals", "velocity"), None, "signals.velocity"),
        (("layers", 1, "biases"), "x", "layers[1].biases must be a list"),
    ],
)
def test_a_file_with_a_mistake_is_refused_with_its_place(
    tmp_path: Path, place: tuple[str | int, ...], value: object, words: str
) -> None:
    path = tmp_path / "n.json"
    write_identified(path, a_network(Layers((3,))))
    data = json.loads(path.read_text())
    at = data
    for key in place[:-1]:
        at = at[key]
    at[place[-1]] = value
    path.write_text(json.dumps(data))
    with pytest.raises(ModelError) as refused:
        load_model(path)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("given_", "words"),
    [
        (("nnoe", "14", None, False, None, False), "are for narx and mlp, not for 'nnoe'"),
        (("narx", "14,x", None, False, None, False), "layers are '14,x'"),
        (("narx", "14,0", None, False, None, False), "a layer of 0 nodes"),
        (("narx", "1,2,3,4", None, False, None, False), "4 hidden layers"),
        (("narx", None, "relu", False, None, False), "activation is 'relu'"),
        (("narx", None, "tansig", True, None, False), "the evolution chooses"),
        (("narx", "14", None, False, 14, False), "nodes and layers are stated"),
        (("narx", "14", None, False, None, True), "do not go with a search"),
    ],
)
def test_layers_that_cannot_be_are_refused_in_one_line(
    given_: tuple[str, str | None, str | None, bool, int | None, bool], words: str
) -> None:
    kind, text, activation, evolved, nodes, searched = given_
    with pytest.raises((DataError, ModelError)) as refused:
        layers_asked(kind, text, activation, evolved=evolved, nodes=nodes, searched=searched)
    assert words in str(refused.value)


def test_layers_are_stated_by_their_nodes() -> None:
    assert layers_asked("narx", None, None, evolved=False, nodes=None) is None
    assert layers_asked("narx", "14, 8", "logsig", evolved=False, nodes=None) == Layers((14, 8), "logsig")
    with pytest.raises(DataError, match="samples for"):
        identify("narx", [hysteretic(1, 300)], layers=Layers((64, 64)))
