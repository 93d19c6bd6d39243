"""Fits of other tools on the arrays of a file, in an environment of their own: `python peer_fits.py ARRAYS.npz`.

Prints a line of JSON for each: tool, fit in free run on what was not learned (%), seconds, seconds of the processor. It
imports nothing of this project.
"""

# Its tools are not installed where the types are checked.
# mypy: ignore-errors

import json
import sys
import time
from collections.abc import Callable

import numpy as np


def main(path: str) -> None:
    """Runs each tool on the inputs (N, m) and the force (N,)."""
    given = np.load(path)
    mean, size = given["u"].mean(axis=0), given["u"].std(axis=0)
    centre, spread = given["y"].mean(), given["y"].std()
    learned = ((given["u"] - mean) / size, (given["y"] - centre) / spread)
    shown = ((given["u_shown"] - mean) / size, (given["y_shown"] - centre) / spread)
    tools = (("sysidentpy FROLS", frols), ("scipy, Bouc-Wen", bouc_wen), ("jax-sysid RNN", recurrent))
    for name, tool in tools:
        began, used = time.perf_counter(), time.process_time()
        force = tool(learned, shown)
        seconds, processor = time.perf_counter() - began, time.process_time() - used
        y = shown[1]
        fit = 100.0 * (1.0 - np.linalg.norm(y - force) / np.linalg.norm(y - y.mean()))
        print(json.dumps({"tool": name, "fit": float(fit), "seconds": seconds, "processor": processor}), flush=True)


def frols(learned: tuple, shown: tuple) -> np.ndarray:
    """Polynomial NARX of degree 3 with 15 terms and three delays; its first samples are the measured force."""
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    (u, y), (u_shown, y_shown) = learned, shown
    delays = [[1, 2, 3] for _ in range(u.shape[1])]
    model = FROLS(
        ylag=3, xlag=delays, n_terms=15, order_selection=False, basis_function=Polynomial(degree=3),
        estimator=LeastSquares(),
    )  # fmt: skip
    # It knows past inputs only: one sample ahead, its last input is the present one.
    ahead, ahead_shown = (np.vstack([one[1:], one[-1:]]) for one in (u, u_shown))
    model.fit(X=ahead, y=y[:, None])
    return np.nan_to_num(model.predict(X=ahead_shown, y=y_shown[:3, None]))[:, 0]


def bouc_wen(learned: tuple, shown: tuple) -> np.ndarray:
    """Bouc-Wen hysteresis beside a dashpot, a spring and an offset, by nonlinear least squares from six starts.

    h' = v·(1 − |h|^n·(b + (1 − b)·sgn(v·h)))/r, stepped from sample to sample in the scaled displacement; the force is
    linear in its other four parameters, which are solved at each step.
    """
    from scipy.optimize import least_squares

    (u, y), (u_shown, _) = learned, shown

    def terms(u: np.ndarray, p: np.ndarray) -> np.ndarray:
        reach, n, b = np.exp(p[0]), 1.0 + np.exp(p[1]), 1.0 / (1.0 + np.exp(-p[2]))
        h, state = np.zeros(u.shape[0]), 0.0
        for k, moved in enumerate(np.diff(u[:, 0]).tolist(), start=1):
            side = 1.0 if moved * state > 0.0 else -1.0
            state += moved * (1.0 - abs(state) ** n * (b + (1.0 - b) * side)) / reach
            h[k] = state = min(max(state, -1.5), 1.5)
        return np.column_stack([h, u[:, 1], u[:, 0], np.ones_like(h)])

    def left(p: np.ndarray) -> np.ndarray:
        phi = terms(u, p)
        return phi @ np.linalg.lstsq(phi, y, rcond=None)[0] - y

    starts = [np.array([reach, 0.0, bend]) for reach in (-4.0, -2.5, -1.0) for bend in (0.0, 2.0)]
    found = min((least_squares(left, one, max_nfev=60) for one in starts), key=lambda one: one.cost)
    weights = np.linalg.lstsq(terms(u, found.x), y, rcond=None)[0]
    return terms(u_shown, found.x) @ weights


def recurrent(learned: tuple, shown: tuple) -> np.ndarray:
    """Recurrent network of 4 states; its first state is estimated from the measured force that is to be shown."""
    import flax.linen as nn
    import jax
    from jax_sysid.models import RNN

    jax.config.update("jax_enable_x64", True)

    def layers(outputs: int) -> Callable[[], nn.Module]:
        class Layers(nn.Module):
            @nn.compact
            def __call__(self, x: jax.Array) -> jax.Array:
                return nn.Dense(features=outputs)(nn.tanh(nn.Dense(features=10)(x)))

        return Layers

    (u, y), (u_shown, y_shown) = learned, shown
    model = RNN(nx=4, ny=1, nu=u.shape[1], FX=layers(4), FY=layers(1), seed=1)
    model.loss(rho_x0=1e-4, rho_th=1e-4)
    model.optimization(adam_epochs=500, lbfgs_epochs=2000, iprint=-1)
    model.fit(y[:, None], u)
    start = model.learn_x0(u_shown, y_shown[:, None], verbosity=False)
    return np.asarray(model.predict(start, u_shown)[0])[:, 0]


if __name__ == "__main__":
    main(sys.argv[1])
