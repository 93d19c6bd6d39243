"""Plan files in HDF5: the designs of the tests, and samples only where no design makes them again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Final

import h5py
import numpy as np
from numpy.typing import NDArray

from excitation.errors import ExcitationError, ExcitationFileError
from excitation.hdf5 import FORMAT, get_excitation, get_json, put_attributes, put_channels
from excitation.kinds import HOMOGENISED, NOISE, REPLAY, Kind
from excitation.plan import MakeExcitation, Test, TestPlan, conditions_of, test_of
from excitation.record_path import resolved, written_beside
from excitation.signal import JSON, Excitation
from excitation.synthesis import FoundPhases, excitation_from_config, excitation_of_phases, phases_of, reads_a_file
from excitation.untrusted import open_hdf5, parse_json

__all__ = ["PLAN_FORMAT", "as_design", "read_plan_hdf5", "write_plan_hdf5"]

PLAN_FORMAT: Final = "damper-rig/plan"
VERSION: Final = 2
"""1: every test with its samples. 2: a test that its design makes again has none."""

_SEARCHED: Final = "phases"
"""Group of phases that a search has found, and attribute of the tests that have them: the samples are made of them in
the time that reading them would take, and levels of a series share them."""

_QUICK: Final = (Kind.MULTISINE, Kind.SINE, Kind.TRIANGLE, Kind.STEPS, Kind.SWEEP, NOISE, Kind.ROAD)
"""Kinds whose samples are made again in about the time that reading them takes."""


def write_plan_hdf5(path: Path, plan: TestPlan, *, folder: Path, whole: bool = False) -> None:
    """Writes the plan; paths of records count from ``folder``. ``whole``: with the samples of records."""
    with h5py.File(path, "w", libver=("earliest", "v110")) as file:
        file.attrs["format"] = PLAN_FORMAT
        file.attrs["format_version"] = VERSION
        tests = file.create_group("tests")
        for n, test in enumerate(plan.tests):
            _put_test(file, tests.create_group(f"{n:04d}"), test, folder, whole)
        if plan.warm_up is not None:
            _put_test(file, file.create_group("warm_up"), plan.warm_up, folder, whole)


def _put_test(file: h5py.File, group: h5py.Group, test: Test, folder: Path, whole: bool) -> None:
    excitation = as_design(test.excitation)
    design = excitation.design
    put_attributes(group, excitation)
    group.attrs["design"] = json.dumps(written_beside(design, folder))
    if excitation.sources is None or (whole and reads_a_file(design)):
        put_channels(group, excitation)
    elif _is_searched(design):
        group.attrs[_SEARCHED] = _put_phases(file, phases_of(excitation))
    group.attrs["name"] = test.name
    group.attrs["conditions"] = json.dumps(conditions_of(test))


def _is_searched(design: Mapping[str, JSON]) -> bool:
    return design.get("kind") == HOMOGENISED or design.get("phases", "random") != "random"


def _put_phases(file: h5py.File, phases: FoundPhases) -> str:
    """Writes them where they are not there yet; returns their name."""
    content = [values for values in (phases.displacement, phases.current) if values is not None]
    name = sha256(b"|".join(values.tobytes() for values in content)).hexdigest()[:16]
    group = file.require_group(_SEARCHED)
    if name not in group:
        own = group.create_group(name)
        for channel, values in zip(("displacement", "current"), content, strict=False):
            own.create_dataset(channel, data=values).attrs["unit"] = "turn"
    return name


def read_plan_hdf5(path: Path, make: MakeExcitation = excitation_from_config) -> TestPlan:
    """Reads a plan; ``make`` makes the tests that have no samples. Raises ExcitationFileError or DesignError."""
    with open_hdf5(path, ExcitationFileError) as file:
        layout, version = file.attrs.get("format"), file.attrs.get("format_version", 1)
        if layout != PLAN_FORMAT or "tests" not in file:
            raise ExcitationFileError(f"{path}: format is {layout!r}: it must be {PLAN_FORMAT!r} or {FORMAT!r}")
        if not 1 <= int(version) <= VERSION:
            raise ExcitationFileError(f"{path}: format_version is {version}: this release reads up to {VERSION}")
        tests = tuple(_get_test(path, file, f"tests/{name}", make) for name in sorted(file["tests"]))
        warm_up = _get_test(path, file, "warm_up", make) if "warm_up" in file else None
    return TestPlan(tests=tests, warm_up=warm_up)


def _get_test(path: Path, file: h5py.File, place: str, make: MakeExcitation) -> Test:
    group, where = file[place], f"{path}: {place}"
    conditions = parse_json(group.attrs.get("conditions", "{}"))
    made = as_design(get_excitation(group, where)) if "channels" in group else _made(path, file, place, make)
    return test_of(str(group.attrs.get("name", "")), made, conditions)


def _made(path: Path, file: h5py.File, place: str, make: MakeExcitation) -> Excitation:
    """What the design makes, if it is as long as the file says."""
    group, where = file[place], f"{path}: {place}"
    design, figures = resolved(get_json(group, "design", where), path.parent), get_json(group, "figures", where)
    if _SEARCHED in group.attrs and design.get("kind") in (Kind.MULTISINE, HOMOGENISED):
        made = excitation_of_phases(design, _get_phases(file, str(group.attrs[_SEARCHED]), where), place)
    else:
        made = make(design, place)
    made = made.with_figures(figures)
    for name in ("sample_rate", "samples", "period_samples"):
        own = getattr(made, f"{name}_hz" if name == "sample_rate" else name)
        if name in group.attrs and group.attrs[name] != own:
            raise ExcitationFileError(
                f"{where}: {name} is {group.attrs[name]}: its design makes {own}: write the plan again"
            )
    return made


def _get_phases(file: h5py.File, name: str, where: str) -> FoundPhases:
    group = file.get(f"{_SEARCHED}/{name}")
    if not isinstance(group, h5py.Group) or "displacement" not in group:
        raise ExcitationFileError(f"{where}: phases {name!r:.40} are not in the file: write the plan again")
    values = [_turns(group[channel], where) if channel in group else None for channel in ("displacement", "current")]
    assert values[0] is not None
    return FoundPhases(displacement=values[0], current=values[1])


def _turns(data: h5py.Dataset, where: str) -> NDArray[np.float64]:
    if not isinstance(data, h5py.Dataset) or data.ndim != 1 or not np.issubdtype(data.dtype, np.floating):
        raise ExcitationFileError(f"{where}: {data.name} must be a 1-D array of floats, in turns")
    values = np.asarray(data[()], dtype=np.float64)
    if not (np.isfinite(values).all() and np.abs(values).max(initial=0.0) <= 1.0):
        raise ExcitationFileError(f"{where}: {data.name}: a phase is not within -1 … 1 turns")
    return values


def as_design(given: Excitation, *, files: bool = False) -> Excitation:
    """What has samples, as its design where that makes the same bytes: a plan then keeps no samples.

    ``files``: also where the design reads a record; never of a design that somebody else has sent.
    """
    design = given.design
    asked = _QUICK if not files else (*_QUICK, REPLAY)
    unread = reads_a_file(design) and not files
    if given.sources is not None or design.get("kind") not in asked or _is_searched(design) or unread:
        return given
    try:
        made = excitation_from_config(design)
    except ExcitationError:
        return given
    stated = (made.kind, made.sample_rate_hz, made.period_samples, made.samples)
    same = stated == (given.kind, given.sample_rate_hz, given.period_samples, given.samples)
    if not (same and np.array_equal(made.displacement_m, given.displacement_m)):
        return given
    current, stored = made.current_a, given.current_a
    same = current is stored if current is None or stored is None else np.array_equal(current, stored)
    return made.with_figures(given.figures) if same else given
