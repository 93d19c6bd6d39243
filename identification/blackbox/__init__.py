"""Black boxes: networks and linear models of the force, identified from runs, free of any physical equation."""

from identification.blackbox.hybrid import Hybrid
from identification.blackbox.identify import KINDS, Base, Identified, identify
from identification.blackbox.model import BlackBox, Member
from identification.blackbox.modelfile import alone_from_json
from identification.blackbox.polynomial import PolynomialNarx
from identification.blackbox.recipes import RECIPES
from identification.blackbox.structure import Regressor, Structure, regressors
from identification.blackbox.writing import write_identified

__all__ = [
    "KINDS",
    "RECIPES",
    "Base",
    "BlackBox",
    "Hybrid",
    "Identified",
    "Member",
    "PolynomialNarx",
    "Regressor",
    "Structure",
    "alone_from_json",
    "identify",
    "regressors",
    "write_identified",
]
