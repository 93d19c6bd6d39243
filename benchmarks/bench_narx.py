"""NARX networks of an MR damper with force distortion: the study, the evolution, the errors, and noise on the inputs.

`python -m benchmarks.bench_narx [PAGE.html]`. After Lin, Ni and Wang (2020), with their table of tests, on a simulated
damper (`sim_rig`, which shares no equation with the identification) whose current ends at 1 A: theirs, of 0 to 2 A, are
halved. Every error is the root mean square, % of that of the force about its mean, of the prediction from measured past
forces, as in the paper, and of the free run, which sees none.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.narx_page import Found, draw
from identification.blackbox.evolution import ITERATIONS, Evolved, evolve
from identification.blackbox.layered import LayeredNarx
from identification.blackbox.layered_training import Layered, train_layered
from identification.blackbox.layers import Layers, Predictor, Rows, rows_of, span_of
from identification.blackbox.model import BlackBox
from identification.blackbox.networks import scales_for
from identification.blackbox.preparation import course_of
from identification.blackbox.samples import Course, samples_of
from identification.blackbox.scaling import Scales
from identification.blackbox.structure import FORCE, Structure, regressors
from identification.blackbox.training import train_member
from identification.fitting import simple_base
from rigctl.runfile import Run
from sim_rig.plant import SimulatedPlant
from sim_rig.sensors import Noise
from sim_rig.specimens import MR_DISTORTION

Floats = NDArray[np.float64]

RATE_HZ, CYCLES = 100.0, 2
CURRENTS = (0.0, 0.25, 0.5, 0.75, 1.0)  # A
SOME = (0.0, 0.5, 1.0)
TESTS = {  # amplitude in mm, frequency in Hz, currents: table 1 of the paper
    "train": ((7.5, 0.5, CURRENTS), (15.0, 1.0, CURRENTS), (7.5, 1.0, SOME), (15.0, 0.5, SOME)),
    "validation": ((7.5, 0.5, (0.5,)), (15.0, 1.0, (0.5,)), (7.5, 1.0, (0.25, 0.75))),
    "test 1": ((15.0, 0.5, (0.25, 0.75)),),
    "test 2": ((10.0, 1.0, CURRENTS), (12.5, 0.75, CURRENTS)),
    "test 3": ((15.0, 0.75, (0.5, 0.75, 1.0)),),
}
INPUTS = ("xvF", "xvi", "xiF", "viF", "xviF")
DELAYS = (1, 2, 3, 4, 5)
NODES, LAYERS, FIFTEEN = (2, 4, 6, 8, 10, 14, 18), (1, 2, 3), Layers((15,))
MOST_NODES = {1: 18, 2: 14, 3: 10}  # in each of so many layers: the time grows with the square of the weights
CHOSEN, FOURTEEN = "viF", Layers((14,))
DELAY, DECAY, STARTS = 2, 0.02, 5
NOISES_DB = (40.0, 30.0, 20.0, 10.0)


def main(paths: Sequence[str] = ()) -> int:
    """Prints all tables, and draws them where a page is named."""
    began = time.process_time()
    courses = {name: [course_of(one, ()) for one in runs_of(name, k)] for k, name in enumerate(TESTS)}
    every = Structure(regressors("F1 x0 v0 i0"), 0)
    scales = scales_for(courses["train"], [every])
    inputs = {(text, delay): both(text, delay, FIFTEEN, courses, scales) for text, delay in product(INPUTS, DELAYS)}
    print("  inputs and delays, 15 nodes, validation: prediction / free run, %")
    for text in INPUTS:
        print(f"    {', '.join(text):12s}" + "  ".join(cell(inputs[text, delay]) for delay in DELAYS))
    sizes = {
        (count, nodes): both(CHOSEN, DELAY, Layers((nodes,) * count), courses, scales)
        for count, nodes in product(LAYERS, NODES)
        if nodes <= MOST_NODES[count]
    }
    print("  nodes of each hidden layer, (v, i, F), delay 2, validation: prediction / free run, %")
    for count in LAYERS:
        print(f"    {count} layers  " + "  ".join(f"{n}: {cell(one)}" for (c, n), one in sizes.items() if c == count))
    evolved, trained = evolution(courses, scales)
    errors = distribution(trained[0], courses, scales)
    noise = {(symbol, db): noisy(trained[0], symbol, db, courses) for symbol, db in product("viF", NOISES_DB)}
    print("  white noise on one input, prediction of the tests, % (without: " + f"{tested(trained[0], courses):.2f})")
    for symbol in "viF":
        print(f"    {symbol}  " + "  ".join(f"{db:g} dB: {noise[symbol, db]:6.2f}" for db in NOISES_DB))
    print(f"  {time.process_time() - began:.0f} s of the processor", flush=True)
    for page in (Path(one) for one in paths if one.endswith(".html")):
        draw(Found(inputs=inputs, sizes=sizes, evolved=evolved, errors=errors, noise=noise), page)
        print(page)
    return 0


def runs_of(name: str, seed: int) -> list[Run]:
    """The runs of a set of tests."""
    return [
        sine(1e-3 * amplitude, hertz, current, seed=100 * seed + k)
        for k, (amplitude, hertz, current) in enumerate((a, f, i) for a, f, currents in TESTS[name] for i in currents)
    ]


def sine(amplitude: float, hertz: float, current: float, *, seed: int) -> Run:
    """A sine at a current in the simulated rig, after one cycle that is not kept."""
    cycle = round(RATE_HZ / hertz)
    x = amplitude * np.sin(2.0 * np.pi * hertz * np.arange((CYCLES + 1) * cycle) / RATE_HZ)
    plant = SimulatedPlant(MR_DISTORTION.damper, Noise(force_n=2.0), seed=seed, start_degc=25.0)
    plant.set_rate(RATE_HZ)
    plant.begin_run()
    read = plant.play(np.column_stack([x, np.full(x.size, current)]))[cycle:]
    return Run(
        run_id=f"sine-{seed}", created="2026-01-01T00:00:00+00:00", specimen="mr-distortion", sample_rate_hz=RATE_HZ,
        period_samples=0, excitation_kind="custom", status="complete",
        channels={"displacement": read[:, 1], "force": read[:, 0], "current": read[:, 2]},
        units={"displacement": "m", "force": "N", "current": "A"},
    )  # fmt: skip


def structure_of(symbols: str, delay: int) -> Structure:
    """All regressors of some signals up to a delay."""
    return Structure(regressors([f"{one}{k}" for one in symbols for k in range(1 if one == "F" else 0, delay + 1)]), 0)


def both(
    symbols: str, delay: int, layers: Layers, courses: Mapping[str, Sequence[Course]], scales: Scales
) -> tuple[float, float]:
    """Error of the prediction and of the free run on the validation, %, of one network."""
    model = train_layered(Layered(structure_of(symbols, delay), layers, DECAY), courses["train"], scales, seed=1)
    return predicted(model, courses["validation"]), free(model, courses["validation"])


def predicted(model: LayeredNarx, shown: Sequence[Course]) -> float:
    """Root mean square error of the prediction, % of that of the force about its mean."""
    rows = rows_of(samples_of(shown, model.structure, model.scales), model.structure.fed_back)
    return share(rows.force - predictor_of(model).simulate(model.weights, rows), rows.force)


def free(model: LayeredNarx, shown: Sequence[Course]) -> float:
    """The same of the free run."""
    error = np.concatenate([(one.force - model.along(one))[one.counted] for one in shown])
    return share(error, np.concatenate([one.force[one.counted] for one in shown]))


def share(error: Floats, force: Floats) -> float:
    """Rms of an error, % of the rms of a force about its mean."""
    return 100.0 * float(np.sqrt(np.mean(error**2)) / np.std(force))


def predictor_of(model: LayeredNarx) -> Predictor:
    """The model as it predicts."""
    return Predictor(model.layers, len(model.structure.regressors), span_of(model.scales[FORCE]))


def cell(pair: tuple[float, float]) -> str:
    """Two errors."""
    return f"{pair[0]:5.2f} / {pair[1]:6.2f}"


def evolution(courses: Mapping[str, Sequence[Course]], scales: Scales) -> tuple[list[Evolved], list[LayeredNarx]]:
    """Evolutions from several seeds, and the networks that were trained from each and from as many random starts."""
    structure = structure_of(CHOSEN, DELAY)
    rows = rows_of(samples_of(courses["train"], structure, scales), structure.fed_back)
    began = time.process_time()
    found = [evolve(FOURTEEN, span_of(scales[FORCE]), rows, seed=seed) for seed in range(STARTS)]
    took = (time.process_time() - began) / STARTS
    print(f"  evolution, {took:.1f} s of the processor each; goal: best fitness 21 % lower (paper 21.2, worst 45.7)")
    chance = [
        evolve(FOURTEEN, span_of(scales[FORCE]), rows, seed=STARTS + k, iterations=0).best[0]
        for k in range(ITERATIONS + 1)
    ]
    print(
        f"    best of as many random individuals as an evolution tries: {min(chance):.3f}, without a step of evolution"
    )
    for one in found:
        print(
            f"    best {one.best[0]:.3f} → {one.best[-1]:.3f} ({100 * one.gain:.1f} % lower), worst {one.worst[0]:.3g} "
            f"→ {one.worst[-1]:.3g}; {one.hidden[0]} and {one.output[0]} → {one.hidden[-1]} and {one.output[-1]}"
        )
    trained: dict[bool, list[LayeredNarx]] = {}
    for evolved in (False, True):
        asked = Layered(structure, FOURTEEN, DECAY, evolved)
        trained[evolved] = [train_layered(asked, courses["train"], scales, seed=seed) for seed in range(STARTS)]
        pairs = [(predicted(one, courses["validation"]), free(one, courses["validation"])) for one in trained[evolved]]
        label = "from the evolution" if evolved else "from random weights, tansig"
        print(
            f"    trained {label:28s} validation, prediction / free run: " + ", ".join(map(cell, pairs))
            + f"; medians {np.median([one for one, _ in pairs]):.2f} / {np.median([one for _, one in pairs]):.2f}"
        )  # fmt: skip
    best = sorted(trained[True], key=lambda one: predicted(one, courses["validation"]))
    return found, best


def distribution(
    model: LayeredNarx, courses: Mapping[str, Sequence[Course]], scales: Scales
) -> dict[str, dict[str, Floats]]:
    """Errors, N, on every test, of the prediction and of the free run, of a static network and an algebraic model."""
    static = train_layered(Layered(structure_of("xvi", 0), FOURTEEN, DECAY), courses["train"], scales, seed=1)
    algebraic = simple_base(runs_of("train", 0))
    fed = Structure(structure_of(CHOSEN, DELAY).regressors, 12)
    member, _ = train_member(fed, scales, courses["train"], decay=DECAY, seed=1)
    output_error = BlackBox(name="", kind="nnoe", dt=courses["train"][0].motion.dt, scales=scales, members=(member,))
    out: dict[str, dict[str, Floats]] = {}
    for name in ("test 1", "test 2", "test 3"):
        shown = courses[name]
        rows = rows_of(samples_of(shown, model.structure, model.scales), model.structure.fed_back)
        one_ahead = (rows.force - predictor_of(model).simulate(model.weights, rows)) * model.scales[FORCE].size
        out[name] = {
            "NARX, prediction": one_ahead,
            "NARX, free run": np.concatenate([(one.force - model.along(one))[one.counted] for one in shown]),
            "NNOE, free run": np.concatenate([(one.force - output_error.along(one))[one.counted] for one in shown]),
            "static network": np.concatenate([(one.force - static.along(one))[one.counted] for one in shown]),
            "algebraic model": np.concatenate(
                [(one.force - algebraic.force(one.motion))[one.counted] for one in shown]
            ),
        }
    print("  error on the tests, N: rms, and the quarters of its distribution")
    for name, errors in out.items():
        for label, error in errors.items():
            low, middle, high = np.percentile(error, [25, 50, 75])
            rms = float(np.sqrt(np.mean(error**2)))
            print(f"    {name}  {label:18s} {rms:7.2f}   {low:7.2f} {middle:7.2f} {high:7.2f}")
    return out


def tested(model: LayeredNarx, courses: Mapping[str, Sequence[Course]]) -> float:
    """Error of the prediction on all tests together, %."""
    return predicted(model, [one for name in ("test 1", "test 2", "test 3") for one in courses[name]])


def noisy(model: LayeredNarx, symbol: str, db: float, courses: Mapping[str, Sequence[Course]]) -> float:
    """Error of the prediction of all tests, %, with white noise of a signal-to-noise ratio on one signal.

    The ratio is that of the variance of the scaled signal; its delayed samples share the noise.
    """
    shown = [one for name in ("test 1", "test 2", "test 3") for one in courses[name]]
    samples, rng = samples_of(shown, model.structure, model.scales), np.random.default_rng(5)
    clean = samples.force[samples.counted]
    columns = [k for k, one in enumerate(model.structure.inputs) if one.symbol == symbol]
    if symbol == "F":
        size = float(np.std(clean)) * 10.0 ** (-db / 20.0)
        samples.force[:] += size * rng.standard_normal(samples.force.size)
    else:
        own = samples.inputs[:, columns[0]]
        added = float(np.std(own)) * 10.0 ** (-db / 20.0) * rng.standard_normal(own.size)
        for column in columns:
            delay = model.structure.inputs[column].delay
            samples.inputs[:, column] += np.concatenate([added[:delay], added[: added.size - delay]])
    rows = rows_of(samples, model.structure.fed_back)
    given = predictor_of(model).simulate(model.weights, Rows(rows.phi, clean))
    return share(clean - given, clean)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
