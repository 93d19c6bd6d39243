"""Black boxes of every kind, with random weights, that forget: for tests that need no training."""

from __future__ import annotations

import numpy as np

from identification.blackbox.hybrid import Hybrid
from identification.blackbox.model import BlackBox, Member
from identification.blackbox.polynomial import PolynomialNarx, terms_of
from identification.blackbox.scaling import Scale
from identification.blackbox.structure import Structure, regressors
from identification.physical.model import Model, element

DT = 1e-3
SCALES = {
    "force": Scale(0.0, 500.0, -1500.0, 1500.0),
    "displacement": Scale(0.0, 0.01, -0.02, 0.02),
    "velocity": Scale(0.0, 0.1, -0.3, 0.3),
    "acceleration": Scale(0.0, 2.0, -9.0, 9.0),
    "current": Scale(0.5, 0.3, 0.0, 1.0),
    "model": Scale(0.0, 500.0, -1500.0, 1500.0),
}


def network(name: str, text: str, nodes: int = 5) -> BlackBox:
    """A network of random weights that forgets: its force feeds back weakly."""
    structure = Structure(regressors(text), nodes)
    rng = np.random.default_rng(3)
    members = tuple(Member(structure, 0.12 * rng.standard_normal(structure.size)) for _ in range(3))
    return BlackBox(name=name, kind="nnoe", dt=DT, scales=SCALES, members=members)


def polynomial() -> PolynomialNarx:
    structure = Structure(regressors("F1 v0 v2 x1"), 0)
    terms = tuple(terms_of(4, 2))
    coefficients = 0.15 * np.random.default_rng(5).standard_normal(len(terms))
    return PolynomialNarx(name="p", dt=DT, scales=SCALES, structure=structure, terms=terms, coefficients=coefficients)


def hybrid() -> Hybrid:
    base = Model(name="base", elements=(element("viscous_damping", {"c": 900.0}),))
    return Hybrid(name="h", base=base, base_file={}, rest=network("rest", "F1 F2 v0 i1 M0 M1"))


BLACK = (
    network("one", "F1 F2 F3 x1 v0 v1 a2 i2"),
    network("no memory", "v0 x0", 4),
    network("stops", "F1 v1 i0 P0 Q1 R0 S0"),
    polynomial(),
    hybrid(),
)
