"""Plan files in HDF5: the designs of the tests, and samples only where no design makes them again."""

from __future__ import annotations

import json
from hashlib import sha256
from pathlib import Path
from typing import Final

import h5py
import numpy as np
from numpy.typing import NDArray

from excitation.attributes import number, shown, text, version, whole
from excitation.errors import DesignError, ExcitationFileError
from excitation.hdf5 import (
    FORMAT,
    check_layout,
    get_excitation,
    get_figures,
    get_json,
    get_kind,
    put_attributes,
    put_channels,
)
from excitation.kinds import HOMOGENISED, Kind
from excitation.plan import MakeExcitation, Test, TestPlan, conditions_of, test_of
from excitation.plan_design import as_design, is_searched
from excitation.record_path import resolved, written_beside
from excitation.signal import Excitation
from excitation.synthesis import FoundPhases, excitation_from_config, excitation_of_phases, phases_of, reads_a_file
from excitation.untrusted import open_hdf5

__all__ = ["PLAN_FORMAT", "read_plan_hdf5", "write_plan_hdf5"]

PLAN_FORMAT: Final = "damper-rig/plan"
VERSION: Final = 3
"""1: every test with its samples. 2: a test that its design makes again has none. 3: the file states how many tests it
has and what each holds, so that a part that was lost is noticed."""

MOST_KEPT_BYTES: Final = 5_000_000
"""Samples of tests without a design that a plan keeps, bytes: a minute of displacement and current at 5 kHz. More slows
whatever copies plans; with half as much short drives after an iteration would need files of their own."""

_STATED: Final = (
    *("format", "format_version", "sample_rate", "samples", "period_samples", "excitation_kind", "design", "figures"),
    *("name", "conditions", "content", "current"),
)
"""Attributes that every test has from version 3 on."""

_SAMPLES, _DESIGN = "samples", "design"
"""Values of the attribute ``content``, beside ``_SEARCHED``: what a test is made of."""

_SEARCHED: Final = "phases"
"""Group of phases that a search has found, and attribute of the tests that have them: the samples are made of them in
the time that reading them would take, and levels of a series share them."""


def write_plan_hdf5(path: Path, plan: TestPlan, *, folder: Path, whole: bool = False) -> None:
    """Writes the plan; paths of records count from ``folder``. ``whole``: with the samples of records, however many.

    Raises ExcitationFileError where the plan would keep too many samples.
    """
    if not whole:
        _check_kept(plan)
    with h5py.File(path, "w", libver=("earliest", "v110")) as file:
        file.attrs["format"] = PLAN_FORMAT
        file.attrs["format_version"] = VERSION
        file.attrs["tests"] = len(plan.tests)
        file.attrs["warm_up"] = int(plan.warm_up is not None)
        tests = file.create_group("tests")
        for n, test in enumerate(plan.tests):
            _put_test(file, tests.create_group(f"{n:04d}"), test, folder, whole)
        if plan.warm_up is not None:
            _put_test(file, file.create_group("warm_up"), plan.warm_up, folder, whole)


def _check_kept(plan: TestPlan) -> None:
    tests = plan.tests if plan.warm_up is None else (*plan.tests, plan.warm_up)
    kept = [(_kept_bytes(as_design(test.excitation)), test.name) for test in tests]
    total, (most, name) = sum(size for size, _ in kept), max(kept)
    if total > MOST_KEPT_BYTES:
        raise ExcitationFileError(
            f"test {name!r} keeps {most / 1e6:.1f} MB of samples that no design makes, the plan {total / 1e6:.1f} MB: "
            f'at most {MOST_KEPT_BYTES / 1e6:g} MB: write it to an excitation file and play that: kind = "file", '
            "record = FILE; or, from Python, write_plan(…, whole=True)"
        )


def _kept_bytes(excitation: Excitation) -> int:
    if excitation.sources is not None:
        return 0
    current = excitation.current_a
    return excitation.displacement_m.nbytes + (0 if current is None else current.nbytes)


def _put_test(file: h5py.File, group: h5py.Group, test: Test, folder: Path, whole: bool) -> None:
    excitation = as_design(test.excitation)
    design = excitation.design
    put_attributes(group, excitation)
    group.attrs["design"] = json.dumps(written_beside(design, folder))
    if excitation.sources is None or (whole and reads_a_file(design)):
        group.attrs["content"] = _SAMPLES
        put_channels(group, excitation)
    elif is_searched(design):
        group.attrs["content"] = _SEARCHED
        group.attrs[_SEARCHED] = _put_phases(file, phases_of(excitation))
    else:
        group.attrs["content"] = _DESIGN
    group.attrs["current"] = int(_has_current(excitation))
    group.attrs["name"] = test.name
    group.attrs["conditions"] = json.dumps(conditions_of(test))


def _has_current(excitation: Excitation) -> bool:
    sources = excitation.sources
    return excitation.current_a is not None if sources is None else sources[1] is not None


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
        where = str(path)
        layout = text(file, "format", where)
        if layout != PLAN_FORMAT:
            raise ExcitationFileError(f"{path}: format is {shown(layout)}: it must be {PLAN_FORMAT!r} or {FORMAT!r}")
        if version(file, where, VERSION) < 3:
            places, warm = [f"tests/{name}" for name in sorted(_group(file, "tests", where))], "warm_up" in file
        else:
            places = [f"tests/{n:04d}" for n in range(_count(file, where))]
            warm = _flag(file, "warm_up", where)
        tests = tuple(_get_test(path, file, place, make) for place in places)
        warm_up = _get_test(path, file, "warm_up", make) if warm else None
    return TestPlan(tests=tests, warm_up=warm_up)


def _count(file: h5py.File, where: str) -> int:
    stated, found = whole(file, "tests", where), len(_group(file, "tests", where))
    if stated != found:
        raise ExcitationFileError(f"{where}: {found} tests: the file says {stated}: write the plan again")
    if ("warm_up" in file) != _flag(file, "warm_up", where):
        raise ExcitationFileError(f"{where}: warm_up is not what the file says of it: write the plan again")
    return stated


def _flag(group: h5py.Group, name: str, where: str) -> bool:
    value = whole(group, name, where)
    if value > 1:
        raise ExcitationFileError(f"{where}: {name} is {value}: it must be 0 or 1")
    return value == 1


def _group(file: h5py.File, place: str, where: str) -> h5py.Group:
    group = file.get(place)
    if not isinstance(group, h5py.Group):
        raise ExcitationFileError(f"{where}: group {place} is missing: write the plan again")
    return group


def _get_test(path: Path, file: h5py.File, place: str, make: MakeExcitation) -> Test:
    group, where = _group(file, place, str(path)), f"{path}: {place}"
    check_layout(group, where)
    if version(file, str(path), VERSION) >= 3:
        _check_content(group, where)
    conditions, name = get_json(group, "conditions", where), text(group, "name", where)
    made = as_design(get_excitation(group, where)) if "channels" in group else _made(path, file, place, make)
    try:
        return test_of(name, made, conditions)
    except DesignError as error:
        raise ExcitationFileError(f"{where}: {error}") from error


def _check_content(group: h5py.Group, where: str) -> None:
    """Raises ExcitationFileError where a test does not hold what it states."""
    for name in _STATED:
        if name not in group.attrs:
            raise ExcitationFileError(f"{where}: attribute {name} is missing: write the plan again")
    stated, current = text(group, "content", where), _flag(group, "current", where)
    found = _SAMPLES if "channels" in group else _SEARCHED if _SEARCHED in group.attrs else _DESIGN
    if stated != found:
        raise ExcitationFileError(f"{where}: content is {shown(stated)}: {found} is there: write the plan again")
    if found == _SAMPLES and ("channels/current_command" in group) != current:
        raise ExcitationFileError(f"{where}: channel current_command is not what current says: write the plan again")
    for data in group["channels"].values() if found == _SAMPLES and isinstance(group["channels"], h5py.Group) else ():
        _check_float64(data, where)


def _made(path: Path, file: h5py.File, place: str, make: MakeExcitation) -> Excitation:
    """What the design makes, if it is what the file says."""
    group, where = file[place], f"{path}: {place}"
    design, figures = resolved(get_json(group, "design", where), path.parent), get_figures(group, where)
    if _SEARCHED in group.attrs and design.get("kind") in (Kind.MULTISINE, HOMOGENISED):
        made = excitation_of_phases(design, _get_phases(file, text(group, _SEARCHED, where), where), place)
    else:
        made = make(design, place)
    made = made.with_figures(figures)
    for name, stated, own in (
        ("sample_rate", number(group, "sample_rate", where), made.sample_rate_hz),
        ("samples", whole(group, "samples", where), made.samples),
        ("period_samples", whole(group, "period_samples", where), made.period_samples),
        ("excitation_kind", get_kind(group, where), made.kind),
        ("current", _flag(group, "current", where) if "current" in group.attrs else None, _has_current(made)),
    ):
        if stated is not None and stated != own:
            raise ExcitationFileError(f"{where}: {name} is {stated}: its design makes {own}: write the plan again")
    return made


def _get_phases(file: h5py.File, name: str, where: str) -> FoundPhases:
    group = file.get(f"{_SEARCHED}/{name}")
    if not isinstance(group, h5py.Group) or "displacement" not in group:
        raise ExcitationFileError(f"{where}: phases {name!r:.40} are not in the file: write the plan again")
    values = [_turns(group[channel], where) if channel in group else None for channel in ("displacement", "current")]
    assert values[0] is not None
    return FoundPhases(displacement=values[0], current=values[1])


def _turns(found: object, where: str) -> NDArray[np.float64]:
    data = _check_float64(found, where)
    if data.attrs.get("unit") != "turn":
        raise ExcitationFileError(f"{where}: {data.name} has unit {shown(data.attrs.get('unit'))}: it must be 'turn'")
    values = np.asarray(data[()], dtype=np.float64)
    if not (np.isfinite(values).all() and np.abs(values).max(initial=0.0) <= 1.0):
        raise ExcitationFileError(f"{where}: {data.name}: a phase is not within -1 … 1 turns")
    return values


def _check_float64(data: object, where: str) -> h5py.Dataset:
    if not isinstance(data, h5py.Dataset) or data.ndim != 1 or data.dtype != np.float64:
        name = getattr(data, "name", "phases")
        raise ExcitationFileError(f"{where}: {name} must be a 1-D array of 64-bit floats: write the plan again")
    return data
