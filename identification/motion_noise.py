"""The noise of the displacement sensor, as the force that a model makes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identification.criteria import FORM
from identification.errors import SimulationError
from identification.noise import between_periods
from identification.physical.model import Model
from identification.physical.predict import predict
from identification.record import ROUNDING, Record

Floats = NDArray[np.float64]

_BANDS, _LEAST_LINES = 8, 50  # of a spectrum, at most and at least: the mean power of 50 lines scatters by 14 %
_LOUD = 0.01  # of the loudest band: what a quieter one says is lost in the leakage of the others


def with_motion_noise(record: Record, model: Model) -> Record:
    """The record with the noise floor that `model` can reach on it.

    A model is driven by the *measured* displacement, and a stiff or heavy one makes much force of little noise in it:
    σ² = var(F − F̂(x)). Over periods both are seen to vary, and a motion that truly differs from period to period, which
    the force follows, is not taken for noise; without periods the two add up.
    """
    stray = _stray(record, model)
    if stray is None:
        return record
    size = float(np.sqrt(np.mean(stray**2)))
    if not 0.0 < size < FORM.minor * float(np.sqrt(np.mean(record.measured**2))):
        return record
    if not (record.period and record.measured.size >= 2 * record.period):
        size *= _borne_out(stray, record, model)
        sigma = float(np.hypot(record.sigma, size))
        share = _independent(stray, record.sigma**2 * record.independent)
        modelled = 1.0 - (record.sigma / sigma) ** 2
        return replace(record, sigma=sigma, independent=min(share, record.independent), modelled=modelled)
    rest = (record.measured - stray).reshape(-1, record.period)
    floor = ROUNDING * float(np.sqrt(np.mean(record.measured**2)))
    single, count = max(between_periods(rest)[0], floor), rest.shape[0]
    noise = (rest - rest.mean(axis=0)).ravel()
    return replace(
        record,
        sigma=float(np.sqrt(record.sigma**2 * (1.0 - 1.0 / count) + single**2 / count)),
        mean_sigma=single / np.sqrt(count),
        independent=_independent(noise, single**2 - float(np.mean(noise**2))),
        modelled=max(0.0, 1.0 - (record.sigma / single) ** 2),
    )


def _borne_out(stray: Floats, record: Record, model: Model) -> float:
    """The share of the motion's noise, at most 1, that what the model leaves bears out.

    The noise adds to whatever else is left, at every frequency: where less is left than it would make, it is less.
    """
    left = record.measured - predict(model, record)[0]
    of_noise, of_rest = (np.abs(np.fft.rfft(e - e.mean()))[1:] ** 2 for e in (stray, left))
    bands = min(_BANDS, max(of_noise.size // _LEAST_LINES, 1))
    parts = [(float(np.mean(a)), float(np.mean(b))) for a, b in
             zip(np.array_split(of_noise, bands), np.array_split(of_rest, bands), strict=True)]  # fmt: skip
    loud = max(own for own, _ in parts)
    return min(1.0, *(float(np.sqrt(rest / own)) for own, rest in parts if own > _LOUD * loud))


def _independent(noise: Floats, white: float) -> float:
    """Share of the samples that count as independent, of coloured `noise` and `white` (its variance) together.

    The energy of n samples of noise scatters as that of n·(Σp)²/(n·Σp²) white ones does, p their power per line.
    """
    power, white = np.abs(np.fft.rfft(noise - noise.mean()))[1:] ** 2 / noise.size, max(white, 0.0)
    level = float(np.mean(power))
    return min(1.0, (level + white) ** 2 / (0.5 * float(np.mean(power**2)) + 2.0 * white * level + white**2))


def _stray(record: Record, model: Model) -> Floats | None:
    """Force of the model on the motion with its noise, less that on the clean one, (M,), N."""
    if record.again is None:
        return None
    try:
        noisy = predict(model, replace(record, motion=record.again))[0]
    except SimulationError:
        return None
    return noisy - predict(model, record)[0]
