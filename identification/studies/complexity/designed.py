"""The test that would tell most of a parameter: designed within the motion that the runs have shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identification.compute import run
from identification.criteria import TEXT
from identification.discrepancy.nexttest import expected_record, in_words, library, seconds_of
from identification.errors import SimulationError
from identification.physical.model import Model
from identification.physical.simulate import simulate
from identification.record import Record, record_from_run
from rigctl.runfile import Run

Floats = NDArray[np.float64]

_TELLS = 0.95  # share of the standard deviation that a test may leave to be worth its time
_TINY = 1e-30


@dataclass(frozen=True, slots=True, kw_only=True)
class Designed:
    """A configuration that `damper-rig design` takes, and the share of the parameter's standard deviation it leaves."""

    parameter: str
    config: Mapping[str, Any]  # JSON
    words: str
    left: float


def designed_tests(
    model: Model, runs: Sequence[Run], parameters: Sequence[str], sigmas: Mapping[str, float]
) -> dict[str, Designed]:
    """For each parameter the test that tells most of it in its time; none where it leaves over 95 % of its deviation.

    What is known is 1/σ² of each free parameter; a test adds JᵀJ/s², J its force by the parameters, s the noise, which
    counts by the second of motion (c-optimality: Elfving 1952; Atkinson & Donev, Optimum Experimental Designs, 1992).
    The tests are sines and triangles within stroke, speed and current of the runs: what the rig has shown it can do.
    """
    if not parameters:
        return {}
    records = [record_from_run(one) for one in runs]
    free = model.free()
    names = [name for name, is_free in zip(model.names(), free, strict=True) if is_free]
    scale = np.array([max(sigmas.get(name, 0.0), 0.0) for name in names])
    known = scale > 0.0
    designs = [one for one in library(records) if seconds_of(one) <= TEXT.longest_test_s]
    told = run(_Information(model, tuple(records), free), designs)
    found = {}
    for name in parameters:
        if name not in names or not known[names.index(name)]:
            continue
        k = int(np.sum(known[: names.index(name)]))
        left = [_left(one, scale, known, k) for one in told]
        times = [max(seconds_of(one), TEXT.least_test_s) for one in designs]
        gains = [(1.0 / share**2 - 1.0) / time for share, time in zip(left, times, strict=True)]
        best = int(np.argmax(gains)) if gains else -1
        if best >= 0 and left[best] <= _TELLS:
            config = dict(designs[best]) | {"name": f"for {name}"}
            found[name] = Designed(parameter=name, config=config, words=in_words(config), left=float(left[best]))
    return found


def _left(information: Floats, scale: Floats, known: NDArray[np.bool_], k: int) -> float:
    """Share of the standard deviation of the k-th known parameter that a test leaves; 1 where it tells nothing."""
    if not np.all(np.isfinite(information)):
        return 1.0
    s = scale[known]
    scaled = information[np.ix_(known, known)] * np.outer(s, s)
    return float(np.sqrt(max(np.linalg.inv(np.eye(s.size) + scaled)[k, k], _TINY)))


class _Information:
    """A task: JᵀJ/s² of a design, (F, F) over the free parameters; not a number where the model fails on it."""

    def __init__(self, model: Model, records: tuple[Record, ...], free: NDArray[np.bool_]) -> None:
        self._model, self._records, self._free = model, records, free

    def __call__(self, config: Mapping[str, Any]) -> Floats:
        record = expected_record(config, self._records)
        count = int(self._free.sum())
        try:
            gradient = simulate(self._model, record.motion, gradient=True).gradient
        except SimulationError:
            return np.full((count, count), np.nan)
        assert gradient is not None  # asked for
        seen = gradient[record.window][:, self._free] / record.sigma
        return np.asarray(seen.T @ seen)
