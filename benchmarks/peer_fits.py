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
    for name, tool in (("sysidentpy FROLS", frols), ("jax-sysid RNN", recurrent)):
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
