"""The elements of a damper model: their rows, the catalogue of all rows, and their compiled equations."""

from identification.physical.elements.catalogue import CATALOGUE
from identification.physical.elements.codes import Code
from identification.physical.elements.spec import PATHS, ElementSpec, Family, ParameterSpec, Path, Starts, Values

__all__ = [
    "CATALOGUE",
    "PATHS",
    "Code",
    "ElementSpec",
    "Family",
    "ParameterSpec",
    "Path",
    "Starts",
    "Values",
]
