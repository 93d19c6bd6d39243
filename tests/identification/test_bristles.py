"""Friction that builds up over a travel and is higher at rest, from another law than that of the catalogue."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.discrepancy.excess import excess_of
from identification.discrepancy.naming import Search, improve_once
from identification.fitting.leastsquares import fit_records
from identification.physical.model import Model, element
from identification.record import Record, compact, record_from_run
from rigctl.runfile import Run
from tests.identification.specimens import FINE, FS, derivative, multisine

Floats = NDArray[np.float64]

BASE = Model(name="a dashpot", elements=(element("viscous_damping", {"c": 800.0}),))


def bent(x: Floats, travel: float) -> Floats:
    """How far bristles are bent that slip at ±1, (N,): a stop over the travel, for a periodic displacement."""
    z, out = 0.0, np.empty(x.size)
    for _ in range(2):
        for k, step in enumerate((np.diff(x, prepend=x[-1]) / travel).tolist()):
            z = min(max(z + step, -1.0), 1.0)
            out[k] = z
    return out


def records(higher_at_rest: float) -> list[Record]:
    """Two multisines on a dashpot of 900 N·s/m beside a friction of 60 N that rises towards rest by that share."""
    made = []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        x = multisine(4096, 0.25, 20.0, 0.02, seed)
        v = derivative(x)
        force = 900.0 * v + 60.0 * (1.0 + higher_at_rest / (1.0 + (v / 0.03) ** 2)) * bent(x, 1e-5)
        channels = {
            name: np.tile(signal[::FINE], 3) + noise * rng.standard_normal(3 * 4096)
            for name, signal, noise in (("displacement", x, 1e-7), ("force", force, 2.0))
        }
        run = Run(
            run_id=f"bristles-{seed}", created="2026-01-01T00:00:00+00:00", specimen="specimen", sample_rate_hz=FS,
            period_samples=4096, excitation_kind="multisine", status="complete", channels=channels,
            units={"displacement": "m", "force": "N"}, design=None, events=(), path=None,
        )  # fmt: skip
        made.append(compact(record_from_run(run)))
    return made


@pytest.mark.parametrize(("higher_at_rest", "name"), [(1.0, "lugre_friction"), (0.0, "presliding_friction")])
def test_it_is_one_name_and_the_richer_one_only_where_friction_falls_with_speed(
    higher_at_rest: float, name: str
) -> None:
    some = records(higher_at_rest)
    base = fit_records(BASE, some)
    bare = Search(fit=base, names=(), excess=excess_of(base), given=BASE, base_excess=excess_of(base))
    found = improve_once(bare, some)
    assert found is not None
    assert found.names == (name,)
    values = found.fit.model.element(name).values()
    assert values["f_c"] == pytest.approx(60.0, rel=0.25)  # another law: its tails are longer
    if higher_at_rest:
        assert values["f_s"] == pytest.approx(120.0, rel=0.25)
