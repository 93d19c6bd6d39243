"""Every attribute, group and dataset of a plan in HDF5, changed: refused in one line, or without a meaning."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from excitation.errors import ExcitationError
from excitation.files import read_excitation, read_plan, write_excitation, write_plan
from excitation.plan import Test, TestPlan, plan_from_config
from excitation.synthesis import excitation_from_config
from tests.excitation.generators import CONFIGS

HOSTILE: Mapping[str, Any] = {
    "text": "x\ny",
    "no text": "",
    "array": np.arange(3.0),
    "array of one": np.array([1]),
    "negative": -1,
    "huge": 2**62,
    "beyond whole numbers": np.uint64(2**64 - 1),
    "huge float": 1e308,
    "nan": np.nan,
    "half": 1.5,
    "empty": h5py.Empty("f8"),
    "no UTF-8": np.bytes_(b"\xff\xfe"),
    "truth": True,
    "list": "[1]",
    "deep": "[" * 900 + "]" * 900,
}
WITHOUT_MEANING = {"description"}  # written for people
PLAUSIBLE = {("name", "list"), ("name", "deep"), ("sample_rate", "half")}  # another name; another rate of kept samples
LEFT_OUT = {"coverage", "coverage_normalised"}  # repeat a figure


def _plan() -> TestPlan:
    """A test of each content: searched phases with a current, a design, samples with a current; and a warm-up."""
    homogenised = {**CONFIGS["homogenised"], "name": "searched", "dwell": 2.0}
    sine = {**CONFIGS["sine"], "name": "sine"}
    plan = plan_from_config({"tests": [homogenised, sine], "warm_up": {**sine, "name": "warm-up"}})
    made = plan.tests[0].excitation
    edited = Test(name="edited", excitation=replace(made, displacement_m=0.5 * made.displacement_m))
    return replace(plan, tests=(*plan.tests, edited))


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("good") / "plan.h5"
    write_plan(path, _plan())
    assert len(read_plan(path).tests) == 3
    return path.read_bytes()


def _places(path: Path) -> dict[str, tuple[bool, list[str]]]:
    """Every object: whether it is a dataset, and the names of its attributes."""
    found = {}
    with h5py.File(path) as file:
        names = ["/"]
        file.visit(names.append)
        for name in names:
            found[name] = isinstance(file[name], h5py.Dataset), list(file[name].attrs)
    return found


def _refusal(path: Path) -> str:
    """The one line that refuses the file; empty where it is read."""
    try:
        for test in read_plan(path).tests:
            assert test.excitation.displacement_m.size
    except ExcitationError as error:
        line = str(error)
        assert "\n" not in line
        assert line.startswith(str(path))
        assert len(line) < len(str(path)) + 300
        assert line.count("plan.h5") == 1
        return line
    return ""


@pytest.mark.slow
def test_every_attribute_that_is_something_else_or_missing_is_refused_in_one_line(good: bytes, tmp_path: Path) -> None:
    path, read = tmp_path / "plan.h5", []
    path.write_bytes(good)
    for place, (_, attributes) in _places(path).items():
        for name in attributes:
            for what, value in [*HOSTILE.items(), ("missing", None)]:
                path.write_bytes(good)
                with h5py.File(path, "r+") as file:
                    del file[place].attrs[name]
                    if what != "missing":
                        file[place].attrs[name] = value
                if _refusal(path) or name in WITHOUT_MEANING or (name, what) in PLAUSIBLE:
                    continue
                if not (what == "missing" and name in LEFT_OUT):
                    read.append(f"{place} {name}: {what}")
    assert not read


def _others(dataset: h5py.Dataset) -> Iterator[tuple[str, Any]]:
    values = dataset[()]
    yield from (("single", values.astype(np.float32)), ("whole", values.astype(np.int64)), ("empty", values[:0]))
    yield from (("matrix", values[None]), ("scalar", values[0]), ("nan", values * np.nan), ("words", ["a"] * 9))
    yield from (("shorter", values[:-1]), ("complex", values.astype(complex)))


def _replaced(path: Path, place: str, how: str, data: Any) -> None:
    """Any: what h5py makes a dataset of."""
    with h5py.File(path, "r+") as file:
        attributes = dict(file[place].attrs)
        del file[place]
        if how == "lost":
            return
        if how == "link":
            file[place] = h5py.SoftLink("/nowhere")
            return
        new = file.create_group(place) if how == "group" else file.create_dataset(place, data=data)
        for name, value in attributes.items():
            new.attrs[name] = value


def test_every_group_and_dataset_that_is_something_else_or_lost_is_refused(good: bytes, tmp_path: Path) -> None:
    path, read = tmp_path / "plan.h5", []
    path.write_bytes(good)
    for place, (is_data, _) in _places(path).items():
        if place == "/":
            continue
        ways: list[tuple[str, Any]] = [("lost", None), ("link", None)]
        if is_data:
            with h5py.File(path) as file:
                ways += [("group", None), *_others(file[place])]
        else:
            ways.append(("dataset", np.arange(5.0)))
        for how, data in ways:
            path.write_bytes(good)
            _replaced(path, place, how, data)
            if not _refusal(path):
                read.append(f"{place}: {how}")
        path.write_bytes(good)
    assert not read


def test_a_file_that_was_cut_off_anywhere_is_refused(good: bytes, tmp_path: Path) -> None:
    path = tmp_path / "plan.h5"
    for size in [*range(100), *range(100, len(good), len(good) // 200), len(good) - 1]:
        path.write_bytes(good[:size])
        assert _refusal(path)


@pytest.mark.parametrize("version", [1, 2])
def test_files_of_earlier_versions_are_still_read(version: int, good: bytes, tmp_path: Path) -> None:
    path = tmp_path / "plan.h5"
    path.write_bytes(good)
    with h5py.File(path, "r+") as file:
        file.attrs["format_version"] = version
        del file.attrs["tests"], file.attrs["warm_up"]
        for group in [*file["tests"].values(), file["warm_up"]]:
            del group.attrs["content"], group.attrs["current"]
    read, made = read_plan(path), _plan()
    assert [test.name for test in read.tests] == [test.name for test in made.tests]
    assert read.warm_up is not None
    for one, other in zip(read.tests, made.tests, strict=True):
        assert one.excitation.displacement_m.tobytes() == other.excitation.displacement_m.tobytes()


@pytest.mark.parametrize("kind", sorted(CONFIGS))
def test_an_excitation_that_lost_its_current_or_was_given_one_is_refused(kind: str, tmp_path: Path) -> None:
    """Played without its current, a controlled damper would answer as another one, in silence."""
    made, path = excitation_from_config(CONFIGS[kind]), tmp_path / "one.h5"
    write_excitation(path, made)
    assert read_excitation(path).samples == made.samples
    with h5py.File(path, "r+") as file:
        if made.current_a is None:
            added = file.create_dataset("channels/current_command", data=np.zeros(made.samples))
            added.attrs["unit"] = "A"
        else:
            del file["channels/current_command"]
    with pytest.raises(ExcitationError, match="channel current_command is not what current says"):
        read_excitation(path)
