"""A static network of x, v, a on thirty sines of a railway yaw damper: Adam by the study's schedule, and second order.

`python -m benchmarks.bench_yaw_mlp [EPOCHS]`. Thirty tests (2 … 25 mm, 0.085 … 255 mm/s, 0.0068 … 8.117 Hz), each of
6 000 points, 80 % of all points are learned. Adam: six layers of 30 rectified linear nodes, 3 000 epochs unless told
otherwise. Second order: one layer of tanh nodes beside a linear part, by Levenberg and Marquardt, as `damper-rig
identify mlp` trains it, on a share of the points that are learned. The damper is simulated (`sim_rig`); its load cell
has 0.1 % of its typical force as noise.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.recording import sine_force
from benchmarks.relu_network import Relu, begun, trained
from identification.blackbox import Structure, regressors
from identification.blackbox.levenberg import train
from identification.blackbox.network import Network
from identification.blackbox.samples import Samples
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
NODES, DECAY, STEPS = 40, 1e-4, 1500
SHARE = 0.15  # of the learned points: 700 a test say what 4 800 do
STEEP = 12_017.0  # s/m: the study's own slope of the arctan, with the speed in m/s
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
    size: float  # N
    learned: NDArray[np.bool_]


def main(given: Sequence[str] = ()) -> int:
    """Prints both on two dampers: as the simulated rig has it, and with the study's slope."""
    epochs = int(given[0]) if given else EPOCHS
    steep = replace(YAW, damper=YAW.damper._replace(slope=STEEP))
    for label, specimen in (("slope 60 s/m", YAW), (f"slope {STEEP:g} s/m", steep)):
        tests = tests_of(specimen)
        print(f"  {label}: {tests.force.shape[0]} tests of {tests.force.shape[1]} points", flush=True)
        named(tests, specimen)
        second_order(tests)
        if epochs and specimen is YAW:
            first_order(tests, epochs)
    return 0


def tests_of(specimen: Specimen) -> Tests:
    """The thirty tests of a specimen."""
    rng = np.random.default_rng(1)
    turn = 2.0 * np.pi * np.arange(POINTS) / POINTS
    inputs, forces = [], []
    for amplitude, frequency in CONDITIONS:
        omega = 2.0 * np.pi * frequency
        columns = (np.sin(turn), omega * np.cos(turn), -(omega**2) * np.sin(turn))
        inputs.append(amplitude * np.column_stack(columns))
        noise = 1e-3 * specimen.force_rms_n * rng.standard_normal(POINTS)
        forces.append(sine_force(specimen, amplitude, frequency, POINTS) + noise)
    seen, force = np.array(inputs), np.array(forces)
    size = float(np.std(force))
    return Tests(seen / np.std(seen, axis=(0, 1)), force / size, size, rng.random(force.shape) < LEARNED)


def named(tests: Tests, specimen: Specimen) -> None:
    """A model with named elements, the enriched Maxwell model, on all points of all tests."""
    runs = [_run(specimen, k, tests.size * force) for k, force in enumerate(tests.force)]
    began = time.process_time()
    model = fit(literature("enriched Maxwell"), runs).model
    force = np.array([simulate_run(model, one)[POINTS:] for one in runs])
    told("enriched Maxwell model, fitted to all points", tests, force / tests.size, began)


def _run(specimen: Specimen, k: int, force: Floats) -> Run:
    """Two periods of the k-th test."""
    amplitude, frequency = CONDITIONS[k]
    x = amplitude * np.sin(2.0 * np.pi * np.arange(2 * POINTS) / POINTS)
    return Run(
        run_id=f"{k}", created="2026-01-01T00:00:00+00:00", specimen=specimen.name, sample_rate_hz=frequency * POINTS,
        period_samples=POINTS, excitation_kind="sine", status="complete",
        channels={"displacement": x, "force": np.tile(force, 2)}, units={"displacement": "m", "force": "N"},
    )  # fmt: skip


def second_order(tests: Tests) -> None:
    """Least squares with the gradient by all weights at once."""
    structure = Structure(regressors("x0 v0 a0"), NODES)
    limits = 1.5 * np.array([tests.force.min(), tests.force.max()])
    net, inputs = Network(structure, limits), tests.inputs.reshape(-1, 3)
    some = np.flatnonzero(tests.learned.ravel() & (np.random.default_rng(2).random(inputs.shape[0]) < SHARE))
    few, every = rows(inputs[some], tests.force.ravel()[some]), rows(inputs, tests.force.ravel())
    train(net, first_weights(structure, 0), few, decay=DECAY, most_steps=1)  # compiles the loops
    began = time.process_time()
    found = train(net, first_weights(structure, 0), few, decay=DECAY, most_steps=STEPS, tolerance=1e-5)
    told(f"second order, {found.steps} steps", tests, net.simulate(found.weights, every), began)


def rows(inputs: Floats, force: Floats) -> Samples:
    """Points without an order in time."""
    return Samples(inputs, force, np.zeros(force.size, dtype=np.int64), np.ones(force.size, dtype=np.bool_))


def first_order(tests: Tests, epochs: int) -> None:
    """Adam on the learned points."""
    inputs, force = tests.inputs.reshape(-1, 3).astype(np.float32), tests.force.ravel().astype(np.float32)
    chosen, began = tests.learned.ravel(), time.process_time()

    def progress(epoch: int, network: Relu) -> None:
        if epoch % 300 == 0 or epoch == epochs:
            left = float(np.sqrt(np.mean((network(inputs)[~chosen] - force[~chosen]) ** 2)))
            print(f"    epoch {epoch}: {100 * left:.3f} % rms, {time.process_time() - began:.0f} s", flush=True)

    found = trained(begun(3, 30, 6, 0), inputs[chosen], force[chosen], epochs=epochs, seed=0, told=progress)
    told(f"Adam, {epochs} epochs", tests, found(inputs).astype(np.float64), began)


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
