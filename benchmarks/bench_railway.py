"""Railway dampers with rubber bushes under the spectrum of a running test: networks beside a linear model.

`python -m benchmarks.bench_railway [PAIRS]`; PAIRS: of the anti-yaw damper so many pairs of phases, `nnoe` beside
`arx`, the first of them that of the table. After a study of an anti-yaw and a lateral damper (2009): the training has
the spectrum of a running test at larger amplitude; what is shown has other phases and 0.7 of the amplitude. The
dampers are simulated and played in the simulated rig, 200 Hz. A hybrid stands on a fitted piecewise-linear dashpot
with a bush.
Goal: mean square error at least 76 % below ARX on the anti-yaw damper, 33 % on the lateral one.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from benchmarks.recording import recorded
from excitation.design import design
from excitation.signal import Excitation
from identification.blackbox import Base, identify
from identification.fitting import fit
from identification.models import simulate_run
from identification.physical.literature import literature
from identification.physical.modelfile import model_to_json
from rigctl.runfile import Run
from sim_rig.specimens import RAILWAY, Specimen

# A lateral damper: a weak knee (the slope beyond it is a half), a softer bush.
LATERAL = replace(
    RAILWAY, name="lateral", text="lateral oil damper with rubber bushes", speed_m_s=0.3, force_rms_n=4000.0,
    damper=RAILWAY.damper._replace(c=40_000.0, c2=18_000.0, f1=4000.0, mount=2.5e6, mount_c=500.0, scale_m_s=0.2),
)  # fmt: skip
DAMPERS = {"anti-yaw": (RAILWAY, 0.006, 0.07, 76.0), "lateral": (LATERAL, 0.025, 0.35, 33.0)}  # stroke, speed, goal %
FORGOTTEN = 600  # samples, 3 s: the bush and a dashpot before its knee remember the motion before the record for 1 s
KINDS = ("arx", "mlp", "nnoe", "hybrid")

# Amplitude of a damper's stroke over frequency as in a run on a straight track: sway of the body at 1 Hz, hunting of
# the bogie at 2.5 Hz, and what the irregularities of the track leave above.
FREQUENCY_HZ = (0.3, 0.6, 1.0, 1.5, 2.2, 2.6, 3.2, 5.0, 8.0, 12.0)
AMPLITUDE = (0.4, 0.7, 1.0, 0.55, 0.5, 0.65, 0.25, 0.08, 0.035, 0.012)


def main(asked: Sequence[str] = ()) -> int:
    """Prints a row for each kind and damper, or one for each pair of phases."""
    if asked:
        return pairs(int(asked[0]))
    for name, (specimen, stroke, speed, goal) in DAMPERS.items():
        learned, shown = (run_of(specimen, stroke, speed, level, k) for k, level in enumerate((1.0, 0.7)))
        errors: dict[str, float] = {}
        for kind in KINDS:
            began = time.process_time()
            base = based(learned) if kind == "hybrid" else None
            found = identify(kind, [learned], held_out=[shown], base=base)
            force = shown.channels["force"][FORGOTTEN:]
            left = force - simulate_run(found.model, shown)[FORGOTTEN:]
            errors[kind] = float(np.mean(left**2))
            shown_fit = 100.0 * (1.0 - float(np.linalg.norm(left) / np.linalg.norm(force - force.mean())))
            below = 100.0 * (1.0 - errors[kind] / errors["arx"])
            print(
                f"  {name:9s} {kind:7s} fit {shown_fit:6.2f} % (predicted {found.predicted:6.2f}), mean square error "
                f"{below:5.1f} % below ARX, goal {goal:g}; {time.process_time() - began:.0f} s of processors",
                flush=True,
            )
    return 0


def pairs(count: int) -> int:
    """Prints how far below ARX the network comes on each pair of phases of the anti-yaw damper."""
    specimen, stroke, speed, _ = DAMPERS["anti-yaw"]
    for k in range(count):
        learned, shown = (run_of(specimen, stroke, speed, level, 2 * k + n) for n, level in enumerate((1.0, 0.7)))
        force, began = shown.channels["force"][FORGOTTEN:], time.process_time()
        models = {kind: identify(kind, [learned]).model for kind in ("arx", "nnoe")}
        used = time.process_time() - began
        errors = {kind: np.mean((force - simulate_run(one, shown)[FORGOTTEN:]) ** 2) for kind, one in models.items()}
        below = 100.0 * (1.0 - errors["nnoe"] / errors["arx"])
        print(f"  pair {k + 1}: mean square error {below:5.1f} % below ARX; {used:.1f} s of processors", flush=True)
    return 0


def run_of(specimen: Specimen, stroke_m: float, speed_m_s: float, level: float, seed: int) -> Run:
    """A run under the spectrum of a running test."""
    table = {"frequency": list(FREQUENCY_HZ), "amplitude": list(AMPLITUDE)}
    motion = {
        "f_min": 0.3, "f_max": 12.0, "spectrum": table, "max_displacement": stroke_m, "max_velocity": speed_m_s,
    }  # fmt: skip
    whole = {"sample_rate": 200.0, "period_samples": 4096, "periods": 1, "seed": 1 + seed, "level": level}
    made = design("random-phase", {**whole, "displacement": motion})
    assert isinstance(made, Excitation)
    return recorded(specimen, made, seed=seed, name=f"{specimen.name} {level:g}")


def based(learned: Run) -> Base:
    """The piecewise-linear dashpot with a bush, fitted."""
    model = fit(literature("piecewise linear with bush"), [learned]).model
    return Base(model, model_to_json(model))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
