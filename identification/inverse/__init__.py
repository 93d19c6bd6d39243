"""Inverse models: the current that makes a damper give a wanted force."""

from identification.inverse.asked import forward_asked, inverse_structures
from identification.inverse.by_forward import by_forward, inverted
from identification.inverse.described import inverse_data, inverse_text
from identification.inverse.identify import IdentifiedInverse, identify_inverse, inverse_runs
from identification.inverse.model import Inverse
from identification.inverse.modelfile import INVERSE, write_inverse
from identification.inverse.reach import Limits, Reach, reach_of
from identification.inverse.tracking import Tracking, track, tracking_data
from identification.inverse.wanted import Wanted, wanted_of

__all__ = [
    "INVERSE",
    "IdentifiedInverse",
    "Inverse",
    "Limits",
    "Reach",
    "Tracking",
    "Wanted",
    "by_forward",
    "forward_asked",
    "identify_inverse",
    "inverse_data",
    "inverse_runs",
    "inverse_structures",
    "inverse_text",
    "inverted",
    "reach_of",
    "track",
    "tracking_data",
    "wanted_of",
    "write_inverse",
]
