"""Writes an identified model of any kind."""

from __future__ import annotations

import os

from identification.blackbox.hybrid import Hybrid, hybrid_to_json
from identification.blackbox.layered import LayeredNarx
from identification.blackbox.layeredfile import layered_to_json
from identification.blackbox.model import BlackBox
from identification.blackbox.modelfile import blackbox_to_json
from identification.blackbox.polynomial import PolynomialNarx
from identification.blackbox.polynomialfile import polynomial_to_json
from identification.models.modelfile import write_json


def write_identified(path: str | os.PathLike[str], model: BlackBox | Hybrid | PolynomialNarx | LayeredNarx) -> None:
    """Write a model file: complete under its name, or not at all; raises ModelFileError."""
    match model:
        case Hybrid():
            write_json(path, hybrid_to_json(model))
        case PolynomialNarx():
            write_json(path, polynomial_to_json(model))
        case LayeredNarx():
            write_json(path, layered_to_json(model))
        case _:
            write_json(path, blackbox_to_json(model))
