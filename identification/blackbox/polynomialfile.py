"""A polynomial NARX model in a model file: terms by the names of their regressors."""

from __future__ import annotations

import math

import numpy as np

from identification.blackbox.modelfile import names_in, number_in, object_in, scales_from_json, scales_to_json
from identification.blackbox.polynomial import PolynomialNarx, Term
from identification.blackbox.structure import MODEL, Structure, regressors
from identification.errors import ModelError
from identification.models.modelfile import FORMAT, FORMAT_VERSION, Json

MOST_TERMS = 1000


def polynomial_to_json(model: PolynomialNarx) -> dict[str, Json]:
    """The model as JSON data."""
    every = [str(one) for one in model.structure.regressors]
    return {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "name": model.name,
        "kind": model.kind,
        "sample_rate": 1.0 / model.dt,
        "signals": scales_to_json(model.scales),
        "regressors": every,
        "terms": [
            {"term": [every[index] for index in term], "coefficient": float(value)}
            for term, value in zip(model.terms, model.coefficients, strict=True)
        ],
        "facts": {name: value if math.isfinite(value) else None for name, value in model.facts.items()},
    }


def polynomial_from_json(data: Json) -> PolynomialNarx:
    """A polynomial from parsed JSON; raises ModelError with the place and the cure."""
    structure = Structure(regressors(names_in("regressors", data.get("regressors"))), 0)
    rate = number_in("sample_rate", data.get("sample_rate"))
    if not rate > 0.0:
        raise ModelError(f"sample_rate is {rate:g} Hz: it must be above 0")
    given = data.get("terms")
    if not isinstance(given, list) or not 1 <= len(given) <= MOST_TERMS:
        raise ModelError(f"terms must be a list of 1 … {MOST_TERMS} terms")
    parts = [object_in(f"terms[{k}]", one) for k, one in enumerate(given)]
    scales = scales_from_json(data.get("signals"))
    missing = {"force", *structure.signals} - set(scales)
    if missing or MODEL in structure.signals:
        raise ModelError(f"signals.{min(missing, default=MODEL)} is missing, or not for a polynomial")
    facts = object_in("facts", data.get("facts", {}))
    return PolynomialNarx(
        name=data.get("name", ""),
        dt=1.0 / rate,
        scales=scales,
        structure=structure,
        terms=tuple(_term(f"terms[{k}].term", one.get("term"), structure) for k, one in enumerate(parts)),
        coefficients=np.array(
            [number_in(f"terms[{k}].coefficient", p.get("coefficient")) for k, p in enumerate(parts)]
        ),
        facts={name: number_in(f"facts.{name}", value) for name, value in facts.items() if value is not None},
    )


def _term(where: str, raw: Json, structure: Structure) -> Term:
    every = [str(one) for one in structure.regressors]
    for symbol in names_in(where, raw):
        if symbol not in every:
            raise ModelError(f"{where}: {symbol!r} is none of {' '.join(every)}")
    return tuple(sorted(every.index(symbol) for symbol in raw))
