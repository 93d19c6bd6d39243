"""Several axes: sub-models whose inputs are chosen by correlation, and training data superposed from single tests."""

from identification.multiaxis.axes import LOADS, MOTIONS, UNITS
from identification.multiaxis.choice import chosen, correlations
from identification.multiaxis.compared import MAIN_FORCE
from identification.multiaxis.described import axes_data, axes_text
from identification.multiaxis.identify import IdentifiedAxes, check_multiaxis, identify_multiaxis, main_axis_runs
from identification.multiaxis.model import MultiAxis, identify_axes
from identification.multiaxis.modelfile import MULTIAXIS, multiaxis_in, write_multiaxis
from identification.multiaxis.superposition import Superposed, check_superposition, superposed

__all__ = [
    "LOADS",
    "MAIN_FORCE",
    "MOTIONS",
    "MULTIAXIS",
    "UNITS",
    "IdentifiedAxes",
    "MultiAxis",
    "Superposed",
    "axes_data",
    "axes_text",
    "check_multiaxis",
    "check_superposition",
    "chosen",
    "correlations",
    "identify_axes",
    "identify_multiaxis",
    "main_axis_runs",
    "multiaxis_in",
    "superposed",
    "write_multiaxis",
]
