"""However a run is written, it is read right or refused in one line: never taken for another one."""

from __future__ import annotations

import warnings
from pathlib import Path

import h5py
import numpy as np
import pytest

from rigctl.errors import ForeignFileError
from rigctl.foreign_files import Choice, import_file
from rigctl.runfile import Run
from tests.foreign.dyno_files import FORCE_N, RATE_HZ, TIME, X_M
from tests.foreign.odd_files import READ, REFUSED


def is_the_run(run: Run) -> None:
    assert run.sample_rate_hz == pytest.approx(RATE_HZ, rel=1e-3)
    assert abs(run.samples - X_M.size) <= 1
    n = min(run.samples, X_M.size)
    x, force = run.channels["displacement"][:n], run.channels["force"][:n]
    assert np.max(np.abs((x - x.mean()) - (X_M[:n] - X_M[:n].mean()))) < 2e-4
    assert np.max(np.abs(force - FORCE_N[:n])) < 0.1


@pytest.mark.parametrize("style", READ)
def test_however_a_run_is_written_it_is_the_run(style: str, tmp_path: Path) -> None:
    content = READ[style]
    (tmp_path / "a.csv").write_bytes(content if isinstance(content, bytes) else content.encode())
    (one,) = import_file(tmp_path / "a.csv", Choice())
    is_the_run(one.run)


@pytest.mark.parametrize("style", REFUSED)
def test_what_may_be_another_run_is_refused_in_one_line(style: str, tmp_path: Path) -> None:
    content, why = REFUSED[style]
    (tmp_path / "a.csv").write_text(content, encoding="utf-8")
    with pytest.raises(ForeignFileError) as refused:
        import_file(tmp_path / "a.csv", Choice())
    assert why in str(refused.value)
    assert "\n" not in str(refused.value)
    assert "Arrow" not in str(refused.value)
    assert "CSV column" not in str(refused.value)


def of_two_rates_mdf(path: Path, delay_s: float = 0.0) -> None:
    from asammdf import MDF, Signal

    fine = np.arange(4 * TIME.size) / (4 * RATE_HZ) + delay_s
    with MDF(version="4.10") as file:
        file.append([Signal(samples=1e3 * X_M, timestamps=TIME, name="Weg", unit="mm")])
        file.append([Signal(samples=np.interp(fine, TIME, FORCE_N), timestamps=fine, name="Kraft", unit="N")])
        file.save(path, overwrite=True)


def of_two_rates_tdms(path: Path, delay_s: float = 0.0) -> None:
    from nptdms import ChannelObject, TdmsWriter

    fine = np.arange(4 * TIME.size) / (4 * RATE_HZ)
    with TdmsWriter(str(path)) as file:
        for group, name, unit, values, step in (
            ("slow", "Stroke", "mm", 1e3 * X_M, 1 / RATE_HZ),
            ("fast", "Force", "N", np.interp(fine, TIME, FORCE_N), 0.25 / RATE_HZ),
        ):
            properties = {"unit_string": unit, "wf_increment": step}
            file.write_segment([ChannelObject(group, name, values, properties=properties)])


@pytest.mark.parametrize(("ending", "write"), [(".mf4", of_two_rates_mdf), (".tdms", of_two_rates_tdms)])
def test_groups_with_times_of_their_own_are_joined_only_on_request(ending: str, write: object, tmp_path: Path) -> None:
    path = tmp_path / f"a{ending}"
    assert callable(write)
    write(path)
    with pytest.raises(ForeignFileError, match=r"groups have times of their own .*--resample HZ"):
        import_file(path, Choice())
    (one,) = import_file(path, Choice(resample_hz=RATE_HZ))
    is_the_run(one.run)
    assert any("put on one time" in note for note in one.told)


def test_groups_that_begin_at_other_times_keep_their_moments(tmp_path: Path) -> None:
    of_two_rates_mdf(tmp_path / "a.mf4", delay_s=0.1)
    (one,) = import_file(tmp_path / "a.mf4", Choice(resample_hz=RATE_HZ))
    skipped = round(0.1 * RATE_HZ)
    assert one.run.channels["displacement"] == pytest.approx(X_M[skipped:], abs=1e-6)
    assert one.run.channels["force"] == pytest.approx(FORCE_N[skipped:], abs=1e-3)


def test_groups_without_a_common_time_are_refused(tmp_path: Path) -> None:
    of_two_rates_mdf(tmp_path / "a.mf4", delay_s=60.0)
    with pytest.raises(ForeignFileError, match="no times in common"):
        import_file(tmp_path / "a.mf4", Choice(resample_hz=RATE_HZ))


def test_an_hdf5_file_of_another_program_is_refused_with_what_it_holds(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["rig/stroke"] = X_M
        file["rig/load"] = FORCE_N
    with pytest.raises(ForeignFileError, match=r"holds rig/load 2000; rig/stroke 2000: .*export it as CSV or MAT"):
        import_file(tmp_path / "a.h5", Choice())


def test_a_matlab_file_of_version_7_3_by_h5py_is_the_run(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with h5py.File(tmp_path / "plain.h5", "w", userblock_size=512, libver=("earliest", "v108")) as file:
            for name, values in (("time_s", TIME), ("stroke_mm", 1e3 * X_M), ("force_N", FORCE_N)):
                file[name] = values[np.newaxis, :]
    raw = bytearray((tmp_path / "plain.h5").read_bytes())
    raw[:116] = (
        b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Mar  2 10:12:13 2026 HDF5 schema 1.00 .".ljust(116)
    )
    (tmp_path / "a.mat").write_bytes(raw)
    (one,) = import_file(tmp_path / "a.mat", Choice())
    is_the_run(one.run)
