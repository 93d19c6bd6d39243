"""Networks of x, v, a on thirty sines of a railway yaw damper: Adam by the study's schedule, and second order.

`python -m benchmarks.bench_yaw_mlp [EPOCHS]`. Thirty tests (2 … 25 mm, 0.085 … 255 mm/s, 0.0068 … 8.117 Hz), each of
6 000 points, 80 % of all points are learned. Adam: six layers of 30 rectified linear nodes, 3 000 epochs unless told
otherwise, on the share of the points that the second order learns too: as many steps as the study's, each over fewer
points; an epoch over all is timed. Second order: one layer of tanh nodes beside a linear part, by Levenberg and
Marquardt, as `damper-rig identify` trains it; once without a memory, once with stop operators of x. The damper is
simulated (`sim_rig`); its load cell has 0.1 % of its typical force as noise. What the true force scores against the
measured one is what any model can.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.recording import sine_force
from benchmarks.relu_network import BATCH, Relu, begun, trained
from identification.blackbox import Structure, regressors
from identification.blackbox.levenberg import train
from identification.blackbox.network import Network
from identification.blackbox.samples import Samples
from identification.blackbox.stops import LIMITS, stopped
from identification.blackbox.training import first_weights
from identification.eearth import eearth
from identification.fitting import fit
from identification.models import simulate_run
from identification.physical.literature import literature
from rigctl.runfile import Run
from sim_rig.specimens import YAW, Specimen

Floats = NDArray[np.float64]

POINTS, LEARNED = 6_000, 0.8
EPOCHS = 3_000
NODES, DECAY, STEPS, FEW_STEPS = 40, 1e-4, 1500, 150
SHARE = 0.15  # of the learned points: 700 a test say what 4 800 do
STEEP = 12_017.0  # s/m: the study's own slope of the arctan, with the speed in m/s
_TIMED = 3  # epochs over all points: their time, no result
SCORED = 12  # every so many points: its slope is over nine intervals, of 500 a period
_SERIES = ((0.002, 8.117), (0.005, 8.117), (0.010, 4.058), (0.015, 2.705), (0.025, 1.623))
_LOWEST, _COUNT = 0.0068, 6
_GOAL = 0.976
CONDITIONS = [(a, float(f)) for a, highest in _SERIES for f in np.geomspace(_LOWEST, highest, _COUNT)]  # m, Hz


@dataclass(frozen=True, slots=True)
class Tests:
    """Inputs (tests, points, 3) and force (tests, points), scaled by their rms; and which points are learned."""

    inputs: Floats
    force: Floats
    true: Floats  # without noise
    size: float  # N
    learned: NDArray[np.bool_]


def main(given: Sequence[str] = ()) -> int:
    """Prints both on two dampers: as the simulated rig has it, and with the study's slope."""
    epochs = int(given[0]) if given else EPOCHS
    steep = replace(YAW, damper=YAW.damper._replace(slope=STEEP))
    for label, specimen in (("slope 60 s/m", YAW), (f"slope {STEEP:g} s/m", steep)):
        tests = tests_of(specimen)
        print(f"  {label}: {tests.force.shape[0]} tests of {tests.force.shape[1]} points", flush=True)
        told("the true force", tests, tests.true, time.process_time())
        hybrid(tests, named(tests, specimen))
        second_order(tests)
        for steps in (FEW_STEPS, STEPS):
            second_order(tests, "PQRS", steps)
        if epochs and specimen is YAW:
            first_order(tests, epochs)
    return 0


def tests_of(specimen: Specimen) -> Tests:
    """The thirty tests of a specimen."""
    rng = np.random.default_rng(1)
    turn = 2.0 * np.pi * np.arange(POINTS) / POINTS
    inputs, forces, truth = [], [], []
    for amplitude, frequency in CONDITIONS:
        omega = 2.0 * np.pi * frequency
        columns = (np.sin(turn), omega * np.cos(turn), -(omega**2) * np.sin(turn))
        inputs.append(amplitude * np.column_stack(columns))
        noise = 1e-3 * specimen.force_rms_n * rng.standard_normal(POINTS)
        truth.append(sine_force(specimen, amplitude, frequency, POINTS))
        forces.append(truth[-1] + noise)
    seen, force = np.array(inputs), np.array(forces)
    size = float(np.std(force))
    scaled, learned = seen / np.std(seen, axis=(0, 1)), rng.random(force.shape) < LEARNED
    return Tests(scaled, force / size, np.array(truth) / size, size, learned)


def named(tests: Tests, specimen: Specimen) -> Floats:
    """The scaled force of the enriched Maxwell model, fitted to all points of all tests."""
    runs = [_run(specimen, k, tests.size * force) for k, force in enumerate(tests.force)]
    began = time.process_time()
    model = fit(literature("enriched Maxwell"), runs).model
    force = np.array([simulate_run(model, one)[POINTS:] for one in runs])
    told("enriched Maxwell model, fitted to all points", tests, force / tests.size, began)
    return force / tests.size


def hybrid(tests: Tests, model: Floats) -> None:
    """The same and a network of x, v, a and its force for what it leaves, with the weight decay of a hybrid."""
    structure = Structure(regressors("x0 v0 a0 M0"), 12)
    rest, began = tests.force - model, time.process_time()
    inputs = np.ascontiguousarray(np.column_stack([tests.inputs.reshape(-1, 3), model.ravel()]))
    size, some = float(np.std(rest)), fewer(tests)
    net = Network(structure, 1.5 * np.array([rest.min(), rest.max()]) / size)
    few, every = (rows(inputs[one], rest.ravel()[one] / size) for one in (some, slice(None)))
    found = train(net, first_weights(structure, 0), few, decay=0.02, most_steps=100)
    force = model.ravel() + size * net.simulate(found.weights, every)
    told("the same and a network for what it leaves", tests, force, began)


def _run(specimen: Specimen, k: int, force: Floats) -> Run:
    """Two periods of the k-th test."""
    amplitude, frequency = CONDITIONS[k]
    x = amplitude * np.sin(2.0 * np.pi * np.arange(2 * POINTS) / POINTS)
    return Run(
        run_id=f"{k}", created="2026-01-01T00:00:00+00:00", specimen=specimen.name, sample_rate_hz=frequency * POINTS,
        period_samples=POINTS, excitation_kind="sine", status="complete",
        channels={"displacement": x, "force": np.tile(force, 2)}, units={"displacement": "m", "force": "N"},
    )  # fmt: skip


def second_order(tests: Tests, stops: str = "", steps: int = STEPS) -> None:
    """Least squares with the gradient by all weights at once; also with stop operators of the displacement."""
    structure = Structure(regressors(["x0", "v0", "a0", *(f"{symbol}0" for symbol in stops)]), NODES)
    limits = 1.5 * np.array([tests.force.min(), tests.force.max()])
    net, inputs = Network(structure, limits), with_stops(tests, stops)
    some = fewer(tests)
    few, every = rows(inputs[some], tests.force.ravel()[some]), rows(inputs, tests.force.ravel())
    train(net, first_weights(structure, 0), few, decay=DECAY, most_steps=1)  # compiles the loops
    began = time.process_time()
    found = train(net, first_weights(structure, 0), few, decay=DECAY, most_steps=steps, tolerance=1e-5)
    label = f"second order{' with stop operators' if stops else ''}, {found.steps} steps, {some.size} points"
    told(label, tests, net.simulate(found.weights, every), began)


def fewer(tests: Tests) -> NDArray[np.int64]:
    """Which of the points are learned: a share of those that may be."""
    rng = np.random.default_rng(2)
    return np.flatnonzero(tests.learned.ravel() & (rng.random(tests.learned.size) < SHARE))


def with_stops(tests: Tests, stops: str) -> Floats:
    """The inputs and the stop operators of the displacement, of the second of two periods, (all points, inputs)."""
    memory = [
        np.concatenate([stopped(np.tile(one, 2), LIMITS[symbol])[POINTS:] for one in tests.inputs[:, :, 0]])
        for symbol in stops
    ]
    return np.ascontiguousarray(np.column_stack([tests.inputs.reshape(-1, 3), *memory]))


def rows(inputs: Floats, force: Floats) -> Samples:
    """Points without an order in time."""
    return Samples(inputs, force, np.zeros(force.size, dtype=np.int64), np.ones(force.size, dtype=np.bool_))


def first_order(tests: Tests, epochs: int) -> None:
    """Adam on the share of the points, in as many steps an epoch as on all of them."""
    inputs, force = tests.inputs.reshape(-1, 3).astype(np.float32), tests.force.ravel().astype(np.float32)
    chosen, some = tests.learned.ravel(), fewer(tests)
    began = time.process_time()
    trained(begun(3, 30, 6, 0), inputs[chosen], force[chosen], epochs=_TIMED, seed=0, told=lambda epoch, network: None)
    print(
        f"    an epoch of Adam over {chosen.sum()} points: {(time.process_time() - began) / _TIMED:.2f} s", flush=True
    )
    began = time.process_time()

    def progress(epoch: int, network: Relu) -> None:
        if epoch % 300 == 0 or epoch == epochs:
            left = float(np.sqrt(np.mean((network(inputs)[~chosen] - force[~chosen]) ** 2)))
            print(f"    epoch {epoch}: {100 * left:.3f} % rms, {time.process_time() - began:.0f} s", flush=True)

    batch = -(-some.size * BATCH // int(chosen.sum()))
    found = trained(begun(3, 30, 6, 0), inputs[some], force[some], epochs=epochs, seed=0, told=progress, batch=batch)
    told(f"Adam, {epochs} epochs, {some.size} points", tests, found(inputs).astype(np.float64), began)


def told(label: str, tests: Tests, force: Floats, began: float) -> None:
    """Error on the points that were not learned, EEARTH of every test, and seconds of the processor."""
    seconds = time.process_time() - began
    given = force.reshape(tests.force.shape)
    error = (given - tests.force)[~tests.learned]
    pairs = zip(tests.force[:, ::SCORED], given[:, ::SCORED], strict=True)
    scores = [eearth(one, other).score for one, other in pairs]
    above, left = sum(one >= _GOAL for one in scores), 100.0 * float(np.sqrt(np.mean(error**2)))
    print(
        f"    {label}: {left:.3f} % rms of the force on what was not learned, EEARTH "
        f"{min(scores):.3f} … {max(scores):.3f} ({above} of {len(scores)} tests at {_GOAL} or more), "
        f"{seconds:.0f} s of the processor",
        flush=True,
    )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
