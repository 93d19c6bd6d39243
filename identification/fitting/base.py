"""The simple physical model that a hybrid builds on where none is given."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identification.fitting.fit import fit
from identification.physical.elements.compositions import yielding
from identification.physical.model import Model, element
from identification.record import record_from_run
from identification.scales import scales_of
from rigctl.runfile import Run

STARTS = 6


def simple_base(runs: Sequence[Run]) -> Model:
    """Viscous damping, a hysteresis with yield, a stiffness and an offset, fitted to the runs.

    The damping and the yield force depend on the current where one is recorded. Raises DataError as `fit` does.
    """
    return fit(simple_start(runs), runs, starts=STARTS).model


def simple_start(runs: Sequence[Run]) -> Model:
    """The same before the fit, its parameters of the size of the runs; raises DataError as `record_from_run` does."""
    records = [record_from_run(one) for one in runs]
    scales = scales_of(records, gap=0.0)
    controlled = any(one.has_current for one in records)
    c, yields = 0.5 * scales.force / scales.v_rms, 0.7 * scales.force
    offset = float(np.mean([one.measured.mean() for one in records]))
    gains = {"c": 0.1 * c, "alpha": 0.1 * yields} if controlled else {}
    rows = yielding(c, yields, 2.0 / scales.v_rms, 0.05 * scales.force / scales.x_rms, offset, gains)
    parts = tuple(element(name, values) for name, values in rows)
    return Model(name="base", elements=parts)
