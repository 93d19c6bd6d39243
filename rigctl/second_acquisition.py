"""Channels of another data acquisition in a run: read, aligned, resampled once, with the uncertainty stated."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from excitation.errors import ExcitationFileError
from excitation.rpc3 import TimeHistory, read_rpc3
from rigctl.alignment import ClockRelation, relation_from_pulses, relation_from_trigger, resampled, rising_edges
from rigctl.errors import AlignmentError
from rigctl.machines.response_file import read_response_csv
from rigctl.runfile import CHANNEL_UNITS, UNITS, Run

FACTORS: Final[Mapping[str, tuple[str, float]]] = {
    "mm": ("m", 1e-3),
    "kN": ("N", 1e3),
    "lbf": ("N", 4.4482216152605),
    "mA": ("A", 1e-3),
    "bar": ("Pa", 1e5),
    "MPa": ("Pa", 1e6),
    "°C": ("degC", 1.0),
    "g": ("m/s²", 9.80665),
    "m/s^2": ("m/s²", 1.0),
    "mV": ("V", 1e-3),
    **{unit: (unit, 1.0) for unit in UNITS},
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Merged:
    """A run with channels of another acquisition, and how well they are aligned."""

    run: Run
    relation: ClockRelation
    timing_u_s: float  # largest standard uncertainty of the alignment within the run
    channel_u: Mapping[str, float]  # of each channel, rms, by the alignment alone: slope times timing_u_s


def read_record(path: str | os.PathLike[str]) -> TimeHistory:
    """A file of another acquisition: RPC III (.rsp, .drv), or .csv with headings 'name [unit]' and the time first.

    Raises
    ------
    AlignmentError
        One line that names the file and what is wrong with it.
    """
    place = Path(path)
    try:
        return read_response_csv(place) if place.suffix.lower() == ".csv" else read_rpc3(place)
    except OSError as error:
        raise AlignmentError(f"{place}: cannot be read ({error.strerror or error})") from error
    except (ExcitationFileError, UnicodeDecodeError) as error:
        raise AlignmentError(str(error)) from error


def by_pulse(
    run: Run, record: TimeHistory, run_channel: str, record_channel: str, level: float | None
) -> ClockRelation:
    """Relation of the clocks from a pulse, or any signal with steep flanks, that both have recorded."""
    if run_channel not in run.channels:
        raise AlignmentError(f"the run has no channel {run_channel!r}: there are {', '.join(run.channels)}")
    column, unit = _column(record, record_channel)
    own = rising_edges(run.channels[run_channel], run.sample_rate_hz, level)
    same_unit = _unit(unit)[0] == run.units[run_channel]
    other = rising_edges(column * _unit(unit)[1], record.sample_rate_hz, level if same_unit else None)
    return relation_from_pulses(own, other)


def by_trigger(run: Run, record: TimeHistory, trigger_s: float, clock_tolerance: float) -> ClockRelation:
    """Relation of the clocks from a trigger at sample 0 of the run, `trigger_s` after the record's first sample."""
    u = float(np.hypot(1.0 / run.sample_rate_hz, 1.0 / record.sample_rate_hz)) / np.sqrt(12.0)
    return relation_from_trigger(0.0, trigger_s, u, clock_tolerance)


def merged(run: Run, record: TimeHistory, relation: ClockRelation, names: Mapping[str, str]) -> Merged:
    """Put channels of a record into a run, on the run's clock; `names` gives the run's name of each.

    A channel that the run has already is kept under its name with ``_rig``.
    """
    channels, units, uncertainties = dict(run.channels), dict(run.units), dict[str, float]()
    timing = relation.uncertainty_s(np.arange(run.samples) / run.sample_rate_hz)
    for theirs, ours in names.items():
        column, unit = _column(record, theirs)
        si, factor = _unit(unit)
        allowed = CHANNEL_UNITS.get(ours, UNITS)
        if si not in allowed:
            raise AlignmentError(f"channel {theirs!r} is in {unit!r}: {ours} must be in {' or '.join(allowed)}")
        if ours in run.channels:
            channels[f"{ours}_rig"], units[f"{ours}_rig"] = run.channels[ours], run.units[ours]
        values = resampled(column * factor, record.sample_rate_hz, relation, run.sample_rate_hz, run.samples)
        channels[ours], units[ours] = values, si
        slope = np.gradient(values, 1.0 / run.sample_rate_hz)
        uncertainties[ours] = float(np.sqrt(np.mean((slope * timing) ** 2)))
    text = f"channels {', '.join(names.values())} of another acquisition: {relation}"
    made = replace(run, channels=channels, units=units, events=(*run.events, (0.0, text)), path=None)
    return Merged(run=made, relation=relation, timing_u_s=float(timing.max()), channel_u=uncertainties)


def _column(record: TimeHistory, name: str) -> tuple[NDArray[np.float64], str]:
    for one in record.channels:
        if one.name == name:
            return one.values, one.unit
    raise AlignmentError(f"the record has no channel {name!r}: there are {', '.join(c.name for c in record.channels)}")


def _unit(unit: str) -> tuple[str, float]:
    if unit not in FACTORS:
        raise AlignmentError(f"unit {unit!r} is unknown: use {', '.join(FACTORS)}")
    return FACTORS[unit]


__all__ = ["Merged", "by_pulse", "by_trigger", "merged", "read_record"]
