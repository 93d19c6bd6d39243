"""A polynomial NARX model in a model file: terms by the names of their regressors."""

from __future__ import annotations

import numpy as np

from identification.blackbox.fields import (
    band_in,
    band_to_json,
    facts_in,
    facts_to_json,
    head_to_json,
    interval_in,
    names_in,
    number_in,
    object_in,
    visited_in,
    visited_to_json,
    weight_in,
)
from identification.blackbox.modelfile import scales_from_json, scales_to_json
from identification.blackbox.polynomial import PolynomialNarx, Term
from identification.blackbox.structure import MODEL, Structure, regressors
from identification.errors import ModelError
from identification.models.modelfile import Json

MOST_TERMS = 1000


def polynomial_to_json(model: PolynomialNarx) -> dict[str, Json]:
    """The model as JSON data."""
    every = [str(one) for one in model.structure.regressors]
    return {
        **head_to_json(model),
        "signals": scales_to_json(model.scales),
        "regressors": every,
        "terms": [
            {"term": [every[index] for index in term], "coefficient": float(value)}
            for term, value in zip(model.terms, model.coefficients, strict=True)
        ],
        **({} if model.steps is None else {"steps": list(model.steps)}),
        "facts": facts_to_json(model.facts),
        **band_to_json(model.band),
        **visited_to_json(model.visited),
    }


def polynomial_from_json(data: Json) -> PolynomialNarx:
    """A polynomial from parsed JSON; raises ModelError with the place and the cure."""
    structure = Structure(regressors(names_in("regressors", data.get("regressors"))), 0)
    given = data.get("terms")
    if not isinstance(given, list) or not 1 <= len(given) <= MOST_TERMS:
        raise ModelError(f"terms must be a list of 1 … {MOST_TERMS} terms")
    parts = [object_in(f"terms[{k}]", one) for k, one in enumerate(given)]
    scales = scales_from_json(data.get("signals"))
    missing = {"force", *structure.signals} - set(scales)
    if missing or MODEL in structure.signals:
        raise ModelError(f"signals.{min(missing, default=MODEL)} is missing, or not for a polynomial")
    return PolynomialNarx(
        name=data.get("name", ""),
        dt=interval_in(data),
        scales=scales,
        structure=structure,
        terms=tuple(_term(f"terms[{k}].term", one.get("term"), structure) for k, one in enumerate(parts)),
        coefficients=np.array(
            [weight_in(f"terms[{k}].coefficient", p.get("coefficient")) for k, p in enumerate(parts)]
        ),
        facts=facts_in(data),
        band=band_in(data),
        visited=visited_in(data),
        steps=_steps(data.get("steps")),
    )


def _steps(raw: Json) -> tuple[float, float] | None:
    if raw is None:
        return None
    if not isinstance(raw, list) or len(raw) != 2:
        raise ModelError("steps must be a list of two changes of the force, N, the lower first")
    return number_in("steps[0]", raw[0]), number_in("steps[1]", raw[1])


def _term(where: str, raw: Json, structure: Structure) -> Term:
    every = [str(one) for one in structure.regressors]
    for symbol in names_in(where, raw):
        if symbol not in every:
            raise ModelError(f"{where}: {symbol!r} is none of {' '.join(every)}")
    return tuple(sorted(every.index(symbol) for symbol in raw))
