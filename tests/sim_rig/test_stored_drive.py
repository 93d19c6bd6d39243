"""An iteration continues with a stored drive; what is no drive for this target and this rig is refused in one line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation.signal import Excitation
from rigctl.drive import IterationSettings
from rigctl.drive_file import read_drive, write_drive
from rigctl.errors import IterationError
from rigctl.iterate import Outcome
from rigctl.recording import rig_text
from tests.sim_rig.conftest import Bench
from tests.sim_rig.iterations import iterated, road


def a_stored_drive(b: Any, target: Excitation, folder: Path) -> Path:
    """Iterate once and store the drive."""
    found = iterated(b, target, folder / "first", settings=IterationSettings(most=1))
    write_drive(folder / "stored.drive.h5", found)
    return folder / "stored.drive.h5"


def test_an_iteration_continues_with_a_stored_drive(bench: Callable[..., Any], tmp_path: Path) -> None:
    b, target = bench(speed=50.0), road(4000)
    stored = read_drive(a_stored_drive(b, target, tmp_path))
    stored.check_rig(rig_text(b.rig.identity()))
    stored.check_target(target)
    found = iterated(b, target, tmp_path / "second", start=stored.drive)
    assert found.outcome is Outcome.CONVERGED
    assert len(found.steps) == 1, "the stored drive is good already"


CHANGES: dict[str, tuple[Callable[[Excitation], Excitation], str]] = {
    "rate": (lambda x: replace(x, sample_rate_hz=500.0), "its sample rate is 1000 Hz, the target has 500 Hz"),
    "length": (lambda x: replace(x, displacement_m=x.displacement_m[1:], current_a=x.current_a[1:]), "4000 samples"),
    "period": (lambda x: replace(x, period_samples=100), "period of 0"),
    "motion": (lambda x: replace(x, displacement_m=1.001 * x.displacement_m), "its displacement is"),
    "current": (lambda x: replace(x, current_a=x.current_a + 0.1), "its current is 0.8 A"),
    "no current": (lambda x: replace(x, current_a=None), "the other has none"),
    "moving current": (lambda x: replace(x, current_a=0.8 + x.displacement_m), "wanted is displacement and current"),
}


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return a_stored_drive(Bench(speed=50.0), road(4000), tmp_path_factory.mktemp("stored"))


@pytest.mark.parametrize("what", CHANGES)
def test_a_stored_drive_for_another_target_is_refused_in_one_line(stored: Path, what: str) -> None:
    change, words = CHANGES[what]
    with pytest.raises(IterationError) as refused:
        read_drive(stored).check_target(change(road(4000)))
    assert words in str(refused.value)
    assert str(stored) in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_drive_that_was_made_on_another_rig_is_refused(stored: Path) -> None:
    with pytest.raises(IterationError, match="this one is 'damper-rig sim_rig 77'"):
        read_drive(stored).check_rig("damper-rig sim_rig 77")


@settings(max_examples=60)
@given(at=st.floats(0, 1), value=st.integers(0, 255), count=st.integers(1, 64))
def test_a_damaged_drive_is_refused_in_one_line_or_read_whole(
    stored: Path, tmp_path_factory: pytest.TempPathFactory, at: float, value: int, count: int
) -> None:
    data = bytearray(stored.read_bytes())
    first = round(at * (len(data) - count))
    data[first : first + count] = bytes([value]) * count
    path = tmp_path_factory.mktemp("damaged") / "bad.drive.h5"
    path.write_bytes(bytes(data))
    refusals, found = [], None
    try:
        found = read_drive(path)
    except IterationError as refused:
        refusals.append(str(refused))
    assert found is None or all(values.size == found.drive.samples for values in found.targets.values())
    assert all("\n" not in refused and str(path) in refused for refused in refusals)


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda file: file.attrs.pop("iteration_rig"), "no stored drive"),
        (lambda file: file.attrs.create("iteration_rig", 7), "no stored drive"),
        (lambda file: file["channels"].pop("displacement_target"), "no stored drive"),
        (lambda file: file["channels/displacement_target"].attrs.modify("unit", "mm"), "has unit 'mm'"),
        (lambda file: file["channels/displacement_target"].write_direct(np.full(4000, np.nan)), "sample 0 is nan"),
        (lambda file: relinked(file, np.zeros(10)), "displacement_target has 10 samples, the drive 4000"),
        (lambda file: relinked(file, h5py.ExternalLink("other.h5", "/x")), "a link to another file"),
        (lambda file: file["channels/displacement_command"].write_direct(np.full(4000, np.inf)), "sample 0 is inf"),
    ],
)
def test_a_file_that_is_no_whole_drive_is_refused(
    stored: Path, tmp_path: Path, spoil: Callable[[h5py.File], object], words: str
) -> None:
    path = tmp_path / "bad.drive.h5"
    path.write_bytes(stored.read_bytes())
    with h5py.File(path, "r+") as file:
        spoil(file)
    with pytest.raises(IterationError, match=words) as refused:
        read_drive(path)
    assert str(refused.value).count(str(path)) == 1


def relinked(file: h5py.File, value: object) -> None:
    """Replace the target by a link or by other values."""
    del file["channels/displacement_target"]
    file["channels/displacement_target"] = value
    if not isinstance(value, h5py.ExternalLink):
        file["channels/displacement_target"].attrs["unit"] = "m"
