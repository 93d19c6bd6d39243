"""The solver compared with a C loop for each model, compiled here, and its error estimated with half the step."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from identification.models.motion import Motion
from identification.physical.accuracy import numerical_error
from identification.physical.literature import literature
from identification.physical.model import Model, element
from identification.physical.simulate import simulate

Floats = NDArray[np.float64]

N, DT = 20_000, 1e-3
SOURCE = Path(__file__).with_name("solver_loops.c")
MAXWELL = {"F1": 8000.0, "S": 60.0, "d": 9000.0, "k": 6.15e6}
VALVE = {"c_soft": 800.0, "c_firm": 4000.0, "u_soft": 0.2, "u_firm": 1.7, "w_knee": 0.4}
TANH = {"alpha": 80.0, "alpha_control": 10.0, "beta": 30.0, "delta": 0.2}
TAU, K, C = 0.012, 1.2e6, 300.0
WEN = {"alpha": 2e5, "A": 1.0, "n": 2.0, "beta": 1e5, "gamma": 1e5}
ENRICHED = {"k1": 4e6, "k2": 3e6, "c2": 2e4}


def main() -> int:
    """Prints nanoseconds a sample and ratios; returns 1 where gcc is missing."""
    if shutil.which("gcc") is None:
        print("gcc is missing: there is no C loop to compare with")
        return 1
    motion = a_motion()
    with tempfile.TemporaryDirectory() as folder:
        library = compiled(Path(folder))
        for name, model, function, parameters, goal in cases():
            force = np.zeros(N)
            run = call(library, function, motion, parameters, force)
            ours, theirs = timed(lambda m=model: simulate(m, motion)), timed(run)
            mine = simulate(model, motion).force
            apart = float(np.linalg.norm(mine[200:] - force[200:]) / np.linalg.norm(force[200:]))
            estimate = numerical_error(model, motion).relative
            ratio = ours / theirs
            print(
                f"  {name:34s} {ours / N * 1e9:6.0f} ns/sample, C {theirs / N * 1e9:6.0f}, ratio {ratio:5.2f}  "
                f"goal {goal}: {'met' if ratio <= goal else 'MISSED'}   apart {apart:.1e}, own error {estimate:.1e}",
                flush=True,
            )
    gradients(motion)
    return 0


def cases() -> list[tuple[str, Model, str, list[float], float]]:
    """Name, model, C function, its parameters, and the goal of the ratio."""
    bouc_wen = [
        element("viscous_damping", {"c": 500.0}),
        element("linear_stiffness", {"k": 1e3}),
        element("bouc_wen", WEN),
    ]
    maxwell = [
        element("arctan_damping", {k: MAXWELL[k] for k in ("F1", "S", "d")}),
        element("series_compliance", {"k": MAXWELL["k"], "c": 0.0}),
    ]
    composed = [
        element("valve_damping", VALVE),
        element("tanh_hysteresis", TANH),
        element("control_lag", {"tau": TAU}),
        element("series_compliance", {"k": K, "c": C}),
    ]
    wen = [500.0, 1e3, *WEN.values()]
    spencer = {
        "series_dashpot.c": 2e4,
        "parallel_stiffness.k": 100.0,
        "viscous_damping.c": 500.0,
        "linear_stiffness.k": 1e3,
    }
    spencer |= {f"bouc_wen.{k}": v for k, v in WEN.items()}
    enriched = {f"relaxing_compliance.{k}": v for k, v in ENRICHED.items()}
    enriched |= {f"arctan_damping.{k}": MAXWELL[k] for k in ("F1", "S", "d")}
    wens, maxwells = [*wen, 2e4, 100.0], list(MAXWELL.values())
    return [
        ("Bouc–Wen, C: RK4 of 4 substeps", Model(name="m", elements=tuple(bouc_wen)), "bouc_wen", wen, 1.2),
        ("modified Bouc–Wen, C: RK4 of 4", literature("modified Bouc–Wen", spencer), "modified", wens, 1.2),
        ("stiff Maxwell, C: Radau IIA", Model(name="m", elements=tuple(maxwell)), "maxwell", maxwells, 1.2),
        ("enriched Maxwell, C: Radau IIA", literature("enriched Maxwell", enriched), "enriched",
         [MAXWELL["F1"], MAXWELL["S"], MAXWELL["d"], *ENRICHED.values()], 1.2),
        ("valve + tanh + lag + mount, C: Radau IIA", Model(name="m", elements=tuple(composed)), "composed",
         [*VALVE.values(), *TANH.values(), TAU, K, C], 2.0),
    ]  # fmt: skip


def gradients(motion: Motion) -> None:
    """Time of the exact gradient relative to the force alone."""
    for name, model, *_ in cases():
        alone, whole = (
            timed(lambda m=model: simulate(m, motion)),
            timed(lambda m=model: simulate(m, motion, gradient=True)),
        )
        count = len(model.names())
        print(
            f"  {name.split(', C')[0]:34s} {count} derivatives {whole / N * 1e9:5.0f} ns/sample, {whole / alone:.1f} ×"
        )


def a_motion() -> Motion:
    """Band-limited displacement of 20 mm up to 20 Hz, with a slowly varying current."""
    t = np.arange(N) * DT
    lines = np.arange(1, round(20.0 * N * DT))
    spectrum = np.zeros(N // 2 + 1, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * np.random.default_rng(1).random(lines.size)) / (
        1 + (lines / (2.0 * N * DT)) ** 2
    )
    x = np.fft.irfft(spectrum, N)
    spectrum *= 0.02 / np.abs(x).max()
    omega = 2 * np.pi * np.fft.rfftfreq(N, DT)
    x, v, a = (np.fft.irfft(spectrum * (1j * omega) ** k, N) for k in range(3))
    i = 0.95 + 0.6 * np.sin(2 * np.pi * 0.37 * t) * np.sin(2 * np.pi * 3.1 * t)
    return Motion(dt=DT, x=x, v=v, a=a, i=i, temperature=np.full(N, 25.0), t=t)


def compiled(folder: Path) -> ctypes.CDLL:
    """The C loops as a library."""
    target = folder / "loops.so"
    command = ["gcc", "-O3", "-march=native", "-shared", "-fPIC", "-o", str(target), str(SOURCE), "-lm"]
    subprocess.run(command, check=True)
    return ctypes.CDLL(str(target))


def call(
    library: ctypes.CDLL, name: str, motion: Motion, parameters: list[float], force: Floats
) -> Callable[[], object]:
    """A call of one loop: (n, dt, x, v, current, parameters, force)."""
    pointer = lambda s: s.ctypes.data_as(ctypes.c_void_p)  # noqa: E731
    values = np.array(parameters)
    x, v, i = (np.ascontiguousarray(s) for s in (motion.x, motion.v, motion.i))
    function = getattr(library, name)
    function.restype = None

    def run(_kept: object = (values, x, v, i)) -> object:
        return function(
            ctypes.c_long(N), ctypes.c_double(DT), pointer(x), pointer(v), pointer(i), pointer(values), pointer(force)
        )

    return run


def timed(call: Callable[[], object], times: int = 120) -> float:
    """Seconds of the fastest of many short calls: what a busy machine can still do undisturbed."""
    call()
    seconds = []
    for _ in range(times):
        began = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - began)
    return min(seconds)


if __name__ == "__main__":
    sys.exit(main())
