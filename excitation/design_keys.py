"""Every key of a design's configuration: what it means, its unit, what may stand there, and its default."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields, is_dataclass
from types import NoneType
from typing import Any, Final, Literal, get_args, get_origin, get_type_hints

from excitation.configuration import key_of, unit_of
from excitation.drive_keys import DRIVE_MEANINGS
from excitation.file_drive import FileSpec
from excitation.force_estimate import ForceEstimate
from excitation.harmonic import SineSpec, StepsSpec, TriangleSpec
from excitation.harmonic_plan_spec import (
    AxisRange,
    HarmonicPlanSpec,
    OrderSpec,
    SeriesSpec,
    SplitSpec,
    WarmUpSpec,
)
from excitation.joined_plan import JoinedPlanSpec
from excitation.lines import LogLines
from excitation.multi_axis import AxisSpec, MultiAxisSpec
from excitation.multisine_spec import CurrentSpec, DisplacementSpec, HomogeniseSpec, MultisineSpec
from excitation.noise import NoiseSpec
from excitation.plan import TestConditions
from excitation.plan_steps import STEPS, Gate, Prompt, Tare
from excitation.presets import PresetSpec
from excitation.replay import ReplaySpec
from excitation.response import Lag, ResponseTable, RigResponse
from excitation.rig import Control, Envelope, ForceLimits, Hydraulics, MotionLimits, Specimen, TemperatureWindow
from excitation.road_drive import RoadDriveSpec
from excitation.spectra import QuarterCar, RecordSpectrum, Road, TableSpectrum
from excitation.sweep import SweepSpec

__all__ = ["COMMANDS", "Key", "keys_of", "keys_text"]

_BAND: Final = {
    "f_min": "lowest line",
    "f_max": "highest line, below half the sample rate",
    "lines": "which lines of the band are excited: a rule, a table of lines spaced by their logarithm, or frequencies",
    "detection_group": "odd-random: one of so many consecutive odd lines is left out",
}
_MEANINGS: Final[Mapping[type, Mapping[str, str]]] = {
    MultisineSpec: {
        "sample_rate": "samples a second",
        "period_samples": "samples of one period: the lines are sample_rate/period_samples apart",
        "displacement": "the displacement",
        "current": "the control current; without it none is played",
        "periods": "periods that are played",
        "seed": "of the random phases: the same seed gives the same file",
        "realisation": "number of another set of phases on the same lines",
        "opposite_current": "the current of the design turned about its mean: of orthogonal realisations",
        "level": "share of the full displacement, which reaches the first of its limits",
        "phases": "random; Schroeder's; or chosen for a low crest factor",
        "crest_of": "phases = \"crest\": what is kept low; limits: whatever comes nearest to its limit",
        "homogenise": "how a homogenised design covers the working range",
        "response": "how the rig follows its commands; what is covered is then measured at the damper",
        "force": "an estimate of the force, to keep it within a limit",
    },
    DisplacementSpec: {
        **_BAND,
        "max_displacement": "limit, from the middle",
        "max_velocity": "limit",
        "max_acceleration": "limit",
        "spectrum": "amplitudes of the lines: flat, quarter-car, road, or a table",
        "quarter_car": "the car of spectrum = \"quarter-car\"",
        "road": "the road under it, and of spectrum = \"road\"",
    },
    CurrentSpec: {
        **_BAND,
        "min": "lowest current",
        "max": "highest current",
        "spectrum": "amplitudes of the lines: flat, control, or a table",
        "corner": "spectrum = \"control\": flat below, falling above",
    },
    LogLines: {
        "count": "frequencies over the band, moved to the nearest lines",
        "odd": "odd lines only; without it those where phases = \"crest\" and they are as many: lower peaks",
    },
    HomogeniseSpec: {
        "method": "direct optimisation of the coverage, or Duym's iteration",
        "variables": "what is covered; without it velocity and current, or displacement and velocity",
        "grid": "cells over the variables, in their order",
        "range": "what the direct method fills: the part of the limits' box that can be filled, all of it, or what the "
        "motion happens to reach",
        "iterations": "at most so many; without it the method's own number",
    },
    RigResponse: {
        "displacement": "of the actuator; without it the displacement is followed exactly",
        "current": "of the current; without it it is followed exactly",
    },
    Lag: {
        "bandwidth": "where a first order is 3 dB down; the natural frequency of a second order",
        "order": "of the lag",
        "damping_ratio": "of a second order",
        "delay": "dead time besides",
    },
    ResponseTable: {
        "frequency": "rising, over the whole band",
        "gain": "of the damper's motion over the command, at these frequencies; linear between them",
        "phase": "likewise, unwrapped, negative where the rig lags",
    },
    ForceEstimate: {
        "max": "limit of the force, either way",
        "damping": "force over velocity at no current",
        "damping_control": "what a current adds to it, N·s/(m·A); the largest current counts",
        "stiffness": "of gas force and mounts",
        "mass": "that moves between load cell and damper",
        "friction": "taken off the limit",
    },
    TableSpectrum: {"frequency": "rising", "amplitude": "relative, at these frequencies; linear between them"},
    RecordSpectrum: {
        "record": "CSV of a service record; its path counts from the configuration",
        "channel": "column of the record",
        "min_contained": "share of the record's power that the band must hold",
        "frequency": "filled in when the record is read",
        "amplitude": "filled in when the record is read",
    },
    QuarterCar: {
        "sprung_mass": "mass above the spring",
        "unsprung_mass": "mass of wheel and axle",
        "spring_rate": "stiffness at the wheel",
        "damping": "damping at the wheel",
        "tyre_rate": "stiffness of the tyre",
    },
    Road: {"corner": "speed times spatial corner: flat below, falling above"},
    MultiAxisSpec: {
        "sample_rate": "samples a second",
        "period_samples": "samples of one period",
        "axes": "one to six: [[axes]]",
        "matrix": "hadamard: 1, 2, 4 or 8 realisations that differ by signs; dft: as many as axes",
        "periods": "periods of each realisation",
        "seed": "of the random phases",
    },
    AxisSpec: {
        "name": "of its column or channel, without spaces",
        "displacement": "of the axis; an angle where the unit is rad",
        "unit": "of the displacement, and with it of its limits",
    },
    HarmonicPlanSpec: {
        "sample_rate": "samples a second",
        "series": "the tests, as combinations: [[series]]",
        "wave_form": "of series that name none",
        "cycles": "cycles of a test, beside the settling ones",
        "settling_cycles": "cycles ahead of these",
        "measure_time": "more cycles where they last less than this",
        "dwell": "rest after a test",
        "min_temperature": "a test waits until the damper is as warm",
        "max_temperature": "a test waits until the damper is as cool",
        "order": "in which order the tests run",
        "split": "which tests are kept for validation and test",
        "warm_up": "what is played while the damper is too cold",
        "envelope": "the rig's limits: a table, or the path of a file",
        "scale_to_fit": "on_excess = \"scale\"",
        "on_excess": "what becomes of a test that exceeds the limits",
    },
    SeriesSpec: {
        "amplitude": "a value, a list or a range; two of amplitude, frequency and peak_velocity are given",
        "frequency": "likewise",
        "peak_velocity": "likewise",
        "current": "likewise; without it none is played",
        "name": "first part of the names of its tests",
        "wave_form": "without it that of the plan",
        "corner_time": "triangles: time in which the motion reverses",
        "cycles": "without it those of the plan",
        "settling_cycles": "without it those of the plan",
        "repeats": "how often each test is played",
        "data_set": "name of the set that its tests belong to",
        "held_out": "without it true where data_set is neither empty nor \"training\"",
    },
    OrderSpec: {
        "method": "mild and severe tests mixed in every block, at random, or as listed",
        "block_size": "tests of a block",
        "seed": "of the random order",
    },
    SplitSpec: {"validation": "share of the tests", "test": "share of the tests", "seed": "of the choice"},
    WarmUpSpec: {
        "amplitude": "of the sine",
        "frequency": "of the sine",
        "cycles": "of one warm-up run",
        "current": "without it none is played",
    },
    Envelope: {
        "motion": "limits of the motion",
        "name": "what the rig is called",
        "force": "limits of the force",
        "hydraulics": "the oil supply",
        "control": "what the controller knows",
        "temperature": "of the damper",
        "specimen": "a rough model of the damper, to predict force and heat",
    },
    MotionLimits: {
        "max_displacement": "from the middle",
        "max_velocity": "largest speed",
        "max_acceleration": "largest acceleration",
        "bandwidth": "frequency up to which the rig follows",
    },
    ForceLimits: {"static": "stall force of the actuator", "dynamic": "its force while it moves"},
    Hydraulics: {
        "piston_area": "of the actuator",
        "supply_pressure": "before the valve",
        "valve_rated_flow": "of the servo valve",
        "valve_rated_pressure_drop": "at its rated flow",
        "pump_flow": "that lasts",
        "accumulator_volume": "oil between full and supply pressure",
        "return_pressure": "behind the valve",
    },
    Control: {
        "sample_rates": "that the controller knows; none: any",
        "min_current": "lowest control current",
        "max_current": "highest control current",
    },
    Prompt: {"text": "what the operator confirms; without it the plan ends"},
    Tare: {
        "limit": "largest reading at rest; without it a share of the rig's force limit",
        "readings": "that are averaged",
    },
    Gate: {
        "of": "whose temperature: the oil's, as the rig measures it, or the room's, as a person reads it",
        "min": "lowest at which the test starts",
        "max": "highest at which the test starts",
        "wait": "for which the oil may cool down",
    },
    TemperatureWindow: {"min": "lowest at which a test may start", "max": "highest at which a test may run"},
    Specimen: {
        "damping": "at no current",
        "damping_control": "what a current adds to it, N·s/(m·A)",
        "friction": "dry friction",
        "heat_capacity": "of damper and oil; without it no temperature is predicted",
        "cooling": "heat lost a kelvin",
        "ambient": "temperature around it",
    },
}  # fmt: skip
_SERIES_OF_MULTISINES: Final = (
    ("levels", "list of numbers", "none", "makes a plan: the design at each of these shares of the full displacement"),
    (
        "realisations",
        "whole number",
        "1",
        "makes a plan: so many sets of phases at each level; random ones with the same amplitudes",
    ),
    (
        "orthogonal",
        "true or false",
        "false",
        "of each two realisations the second has the same displacement and the "
        "opposite current: the inputs are orthogonal at every line",
    ),
    ("scale_to_fit", "true or false", "false", 'on_excess = "scale"'),
)
_OF_THE_RIG: Final = (
    ("envelope", "table or path", "none", "the rig's limits, as in harmonic plans"),
    ("on_excess", '"refuse" or "drop" or "shorten" or "scale"', "refuse", "what becomes of a test that exceeds them"),
)
_ROOTS: Final[Mapping[str, type]] = {
    "random-phase": MultisineSpec, "homogenised": MultisineSpec, "steps": StepsSpec, "sweep": SweepSpec,
    "noise": NoiseSpec, "road": RoadDriveSpec, "replay": ReplaySpec, "harmonic": HarmonicPlanSpec, "preset": PresetSpec,
    "plan": JoinedPlanSpec, "multi-axis": MultiAxisSpec,
}  # fmt: skip
_TESTS: Final[Mapping[str, type]] = {
    "conditions": TestConditions,
    "sine": SineSpec,
    "triangle": TriangleSpec,
    "file": FileSpec,
}
"""Tests of a plan file: what all may have, and the kinds that no command above makes alone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Key:
    """One key; ``place`` is its table, "" at the top of the file."""

    place: str
    name: str
    unit: str
    value: str  # what may stand there
    default: str  # "required" where there is none
    meaning: str

    def __str__(self) -> str:
        unit = f", {self.unit}" if self.unit else ""
        return f"{self.name}  ({self.value}{unit}; {self.default}): {self.meaning}"


def keys_of(command: str) -> tuple[Key, ...]:
    """The keys of a command's configurations, or of a test of a plan, those of each table together.

    Read from the classes that the configuration is checked against.
    """
    own = tuple(_below({**_ROOTS, **_TESTS}[command], ""))
    if command in _TESTS or _ROOTS[command] in (HarmonicPlanSpec, MultiAxisSpec):
        return own
    more = _SERIES_OF_MULTISINES if _ROOTS[command] is MultisineSpec else ()
    first = [Key(place="", name=n, unit="", value=v, default=d, meaning=m) for n, v, d, m in (*more, *_OF_THE_RIG)]
    return (*first, *own)


COMMANDS: Final = (*_ROOTS, *_TESTS)


def keys_text(command: str) -> str:
    """The keys of a configuration, a line each below the name of their table."""
    what = "a test in a plan file: conditions" if command == "conditions" else f"a test of kind {command}"
    lines, place = [f"keys of {what if command in _TESTS else f'a {command} configuration'}"], ""
    for key in keys_of(command):
        if key.place != place:
            place = key.place
            lines.append(f"\n[{place}]")
        lines.append(f"  {key}")
    return "\n".join(lines)


def _below(kind: type[Any], place: str) -> Iterator[Key]:
    """The keys of a table, then those of its tables. Any: a dataclass."""
    hints, tables = get_type_hints(kind), []
    for one in fields(kind):
        name, hint = key_of(one.name), hints[one.name]
        yield Key(
            place=place, name=name, unit=unit_of(one.name), value=_value(hint), default=_default(one),
            meaning={**_MEANINGS, **DRIVE_MEANINGS}[kind][name],
        )  # fmt: skip
        tables += [(table, f"{place}.{name}".lstrip(".")) for table in _tables(hint) if table is not AxisRange]
        if kind is TestConditions and name == "before":
            tables += [(table, f'{name}, step = "{step}"') for step, table in STEPS.items()]
    for table, where in tables:
        yield from _below(table, where)


def _tables(hint: Any) -> list[type]:
    """The dataclasses in a type. Any: whatever stands behind a field."""
    if is_dataclass(hint) and isinstance(hint, type):
        return [hint]
    return [table for part in get_args(hint) for table in _tables(part)]


def _value(hint: Any) -> str:
    """What may stand there, in words. Any: as above."""
    parts = get_args(hint)
    if get_origin(hint) is Literal:
        return " or ".join(f'"{part}"' for part in parts)
    if get_origin(hint) is dict:
        return "table"
    if get_origin(hint) is tuple:
        return "list of tables" if _tables(hint) else "list"
    if parts:
        return " or ".join(dict.fromkeys(_value(part) for part in parts if part is not NoneType))
    if hint is AxisRange:
        return "range {min, max, count, spacing}"
    plain = {float: "number", int: "whole number", bool: "true or false", str: "text"}
    return plain.get(hint, "table")


def _default(one: Any) -> str:
    """Its default in words. Any: a field of a dataclass."""
    if one.default is MISSING:
        return "required" if one.default_factory is MISSING else "optional"
    if one.default is None or one.default in ("", ()):
        return "none"
    if isinstance(one.default, bool):
        return str(one.default).lower()
    return f"{list(one.default)}" if isinstance(one.default, tuple) else f"{one.default:g}" if isinstance(
        one.default, float) else str(one.default)  # fmt: skip
