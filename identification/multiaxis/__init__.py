"""Several axes: sub-models whose inputs are chosen by correlation, and training data superposed from single tests."""

from identification.multiaxis.axes import LOADS, MOTIONS
from identification.multiaxis.choice import chosen, correlations
from identification.multiaxis.model import MultiAxis, identify_axes
from identification.multiaxis.superposition import Superposed, check_superposition, superposed

__all__ = [
    "LOADS",
    "MOTIONS",
    "MultiAxis",
    "Superposed",
    "check_superposition",
    "chosen",
    "correlations",
    "identify_axes",
    "superposed",
]
