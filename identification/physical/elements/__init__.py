"""The elements of a damper model: their rows, the catalogue of all rows, and their compiled equations."""

from identification.physical.elements.catalogue import CATALOGUE, code_of
from identification.physical.elements.spec import PATHS, ElementSpec, Family, ParameterSpec, Path, Starts, Values

__all__ = [
    "CATALOGUE",
    "PATHS",
    "ElementSpec",
    "Family",
    "ParameterSpec",
    "Path",
    "Starts",
    "Values",
    "code_of",
]
