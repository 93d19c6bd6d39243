"""The elements of a damper model: their rows, the catalogue of all rows, and their compiled equations."""

from identification.physical.elements.catalogue import CATALOGUE, SHIFT, TONE, code_of, codes_of
from identification.physical.elements.spec import (
    PATHS,
    Curve,
    Departure,
    ElementSpec,
    Family,
    Growth,
    ParameterSpec,
    Path,
    Remedy,
    Starts,
    Surroundings,
    Values,
)

__all__ = [
    "CATALOGUE",
    "PATHS",
    "SHIFT",
    "TONE",
    "Curve",
    "Departure",
    "ElementSpec",
    "Family",
    "Growth",
    "ParameterSpec",
    "Path",
    "Remedy",
    "Starts",
    "Surroundings",
    "Values",
    "code_of",
    "codes_of",
]
