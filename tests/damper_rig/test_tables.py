"""Runs go to pandas and xarray and come back; any other table is read and checked as a file is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import damper_rig as dr
from tests.api.measured import a_run

RUN = a_run(0, 2.0)
T = np.arange(RUN.samples) / RUN.sample_rate_hz


@settings(max_examples=20)
@given(rate=st.floats(1.0, 1e5), samples=st.integers(2, 3000))
def test_a_run_comes_back_as_it_was(rate: float, samples: int) -> None:
    cut = {name: values[:samples].copy() for name, values in RUN.channels.items()}
    run = replace(RUN, sample_rate_hz=rate, channels=cut)
    for again in (dr.from_pandas(dr.to_pandas(run)), dr.from_xarray(dr.to_xarray(run))):
        assert again.sample_rate_hz == pytest.approx(rate, rel=1e-6)
        assert all(np.array_equal(again.channels[name], cut[name]) for name in cut)
        facts = [(r.units, r.excitation_kind, r.period_samples, r.specimen, r.run_id) for r in (again, run)]
        assert facts[0] == facts[1]


def test_a_table_of_somebody_else_is_guessed_as_a_file_is() -> None:
    frame = pd.DataFrame(
        {"Zeit [s]": T, "Weg in mm": 1e3 * RUN.channels["displacement"], "Kraft [kN]": 1e-3 * RUN.channels["force"]}
    )
    run = dr.from_pandas(frame)
    assert run.sample_rate_hz == RUN.sample_rate_hz
    assert run.excitation_kind == "sine"
    for name, values in RUN.channels.items():
        assert np.allclose(run.channels[name], values)


def test_an_index_of_times_is_the_time() -> None:
    channels = {"stroke_mm": 1e3 * RUN.channels["displacement"], "force_N": RUN.channels["force"]}
    for index in (pd.to_timedelta(T, unit="s"), pd.Timestamp("2026-01-01") + pd.to_timedelta(T, unit="s")):
        run = dr.from_pandas(pd.DataFrame(channels, index=index.rename("time")))
        assert run.sample_rate_hz == pytest.approx(1000.0)


def test_what_cannot_be_guessed_is_stated() -> None:
    frame = pd.DataFrame({"t": T, "a": 1e3 * RUN.channels["displacement"], "b": -RUN.channels["force"]})
    with pytest.raises(ValueError, match=r"DataFrame: .*no force is found"):
        dr.from_pandas(frame)
    with pytest.warns(dr.DataWarning, match="sign of force is turned"):
        run = dr.from_pandas(frame, columns={"time": "t:s", "displacement": "a:mm", "force": "b:N"}, flip=["force"])
    assert np.allclose(run.channels["force"], RUN.channels["force"])


def test_a_table_with_a_row_missing_is_refused() -> None:
    frame = dr.to_pandas(RUN)
    with pytest.raises(ValueError, match="row"):
        dr.from_pandas(frame.drop(frame.index[100]))


def test_a_dataset_states_its_units_as_attributes() -> None:
    dataset = dr.to_xarray(RUN)
    assert dataset["force"].attrs["units"] == "N"
    other = xr.Dataset(
        {
            "stroke": ("time", 1e3 * RUN.channels["displacement"], {"units": "mm"}),
            "load": ("time", RUN.channels["force"], {"units": "N"}),
        },
        coords={"time": ("time", 1e3 * T, {"units": "ms"})},
    )
    assert np.allclose(dr.from_xarray(other).channels["displacement"], RUN.channels["displacement"])
    with pytest.raises(ValueError, match="one is due"):
        dr.from_xarray(other.expand_dims("specimen"))


def test_results_are_tables_of_their_rows() -> None:
    assert list(dr.to_pandas(dr.elements())["element"]) == list(dr.elements())
