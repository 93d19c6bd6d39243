"""A file of any usual make becomes the same run, without an option."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rigctl.foreign_endings import BINARY, ENDINGS, TEXT, WORKBOOKS
from rigctl.foreign_files import Choice, Imported, import_file
from rigctl.foreign_files.read import BINARY_READERS
from tests.foreign.dyno_files import BINARY_STYLES, FORCE_N, RATE_HZ, SAMPLES, TEMPERATURE, TEXT_STYLES, X_M


def the_one(path: Path, **stated: object) -> Imported:
    (one,) = import_file(path, Choice(**stated))  # type: ignore[arg-type]
    return one


def is_the_run(one: Imported, digits: float = 2e-5) -> None:
    run = one.run
    assert run.samples == SAMPLES
    assert run.sample_rate_hz == pytest.approx(RATE_HZ, rel=1e-6)
    for name, truth in (("displacement", X_M), ("force", FORCE_N)):
        assert np.max(np.abs(run.channels[name] - truth)) < digits * np.ptp(truth), name
    assert run.excitation_kind == "sine"
    assert run.status == "complete"


@pytest.mark.parametrize("style", TEXT_STYLES)
def test_a_text_file_of_any_make_becomes_the_run(style: str, tmp_path: Path) -> None:
    TEXT_STYLES[style](tmp_path / "a.csv")
    one = the_one(tmp_path / "a.csv")
    is_the_run(one)
    if style in ("german", "suffixes"):
        assert np.allclose(one.run.channels["temperature"], TEMPERATURE, atol=1e-5)
    if style == "command_beside":
        assert np.allclose(one.run.channels["displacement_command"], 1.01 * X_M, atol=1e-6)
    if style == "imperial":
        assert "velocity" in one.run.channels


@pytest.mark.parametrize("style", BINARY_STYLES)
def test_a_binary_file_of_any_make_becomes_the_run(style: str, tmp_path: Path) -> None:
    ending, write = BINARY_STYLES[style]
    write(tmp_path / f"a{ending}")
    is_the_run(the_one(tmp_path / f"a{ending}"), digits=5e-5)


def test_every_ending_that_is_told_has_its_reader() -> None:
    assert set(BINARY_READERS) == set(BINARY)
    assert len(set(ENDINGS)) == len(ENDINGS) == len(TEXT) + len(WORKBOOKS) + len(BINARY)


@pytest.mark.parametrize("style", BINARY_STYLES)
def test_the_format_is_known_by_its_bytes_too(style: str, tmp_path: Path) -> None:
    ending, write = BINARY_STYLES[style]
    write(tmp_path / f"a{ending}")
    (tmp_path / f"a{ending}").rename(tmp_path / "a.data")
    is_the_run(the_one(tmp_path / "a.data"), digits=5e-5)
