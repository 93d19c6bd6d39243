"""What is wrong with a file is refused or told in one line, with its place and what would be right."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigctl.errors import ForeignFileError
from rigctl.foreign_files import Choice, ColumnChoice, Imported, import_file
from rigctl.foreign_files.clock import read_clock
from tests.foreign.dyno_files import FORCE_N, SAMPLES, TIME, V_M_S, X_M, Floats, rows

HEAD = "Time (s),Displacement (mm),Force (N)\n"


def written(path: Path, columns: list[Floats], head: str = HEAD, form: str = "{:.6f}") -> Path:
    path.write_text(head + rows(columns, ",", form=form))
    return path


def good(path: Path) -> Path:
    return written(path, [TIME, 1e3 * X_M, FORCE_N])


def the_one(path: Path, choice: Choice | None = None) -> Imported:
    (one,) = import_file(path, choice or Choice())
    return one


def refusal(path: Path, choice: Choice | None = None) -> str:
    with pytest.raises(ForeignFileError) as caught:
        import_file(path, choice or Choice())
    said = str(caught.value)
    assert said.startswith(f"{path}: ")
    assert "\n" not in said
    return said


def columns(**stated: str) -> dict[str, ColumnChoice]:
    return {name: ColumnChoice(column=text.split(":")[0], unit=text.split(":")[-1]) for name, text in stated.items()}


def test_a_stated_rate_beside_times_of_another_one_is_refused(tmp_path: Path) -> None:
    said = refusal(good(tmp_path / "a.csv"), Choice(rate_hz=1000.0))
    assert "500 Hz" in said
    assert "1000 Hz" in said


def test_a_rate_that_the_header_states_is_compared_with_the_times_too(tmp_path: Path) -> None:
    written(tmp_path / "a.csv", [TIME, 1e3 * X_M, FORCE_N], "Sample rate: 1 kHz\n" + HEAD)
    assert "the times are those of 500 Hz and 1000 Hz is stated" in refusal(tmp_path / "a.csv")


def test_missing_rows_are_refused_with_their_place_and_interpolated_on_request(tmp_path: Path) -> None:
    kept = np.delete(np.arange(SAMPLES), [700, 701, 1500])
    path = written(tmp_path / "a.csv", [TIME[kept], 1e3 * X_M[kept], FORCE_N[kept]])
    said = refusal(path)
    assert "line 702: 2 rows are missing at 1.398 s (2 gaps, 3 rows in all): --resample 500" in said
    one = the_one(path, Choice(resample_hz=500.0))
    assert np.allclose(one.run.channels["displacement"], X_M, atol=2e-5)
    assert any("2 gaps filled" in text for text in one.told)


def test_a_hole_in_which_the_motion_is_not_known_is_never_filled(tmp_path: Path) -> None:
    kept = np.delete(np.arange(SAMPLES), np.arange(700, 760))
    path = written(tmp_path / "a.csv", [TIME[kept], 1e3 * X_M[kept], FORCE_N[kept]])
    assert "too long to interpolate" in refusal(path, Choice(resample_hz=500.0))


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda t: np.where(np.arange(t.size) == 900, t[899], t), "line 902: the time stands twice"),
        (lambda t: np.concatenate([t[:1000], t[:1000]]), "line 1002: the time goes back by 1.998 s"),
        (lambda t: t + 1e-3 * np.cumsum(np.sin(np.arange(t.size) / 300.0)) / 2, "uneven"),
    ],
    ids=["doubled", "backwards", "uneven"],
)
def test_times_that_are_no_clock_are_refused(change: object, word: str, tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", [change(TIME), 1e3 * X_M, FORCE_N])  # type: ignore[operator]
    assert word in refusal(path)


def test_times_with_too_few_digits_are_told_and_taken_as_even(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    lines = [f"{t:.2f},{x:.5f},{f:.4f}" for t, x, f in zip(TIME, 1e3 * X_M, FORCE_N, strict=True)]
    path.write_text(HEAD + "\n".join(lines) + "\n")
    one = the_one(path)
    assert one.run.sample_rate_hz == pytest.approx(500.0, rel=2e-3)
    assert "written to 0.01 s" in one.told[0]


@settings(max_examples=50)
@given(rate=st.floats(0.5, 1e5), jitter=st.floats(0.0, 0.2), seed=st.integers(0, 1000))
def test_a_rate_is_read_through_any_jitter_that_keeps_the_samples_apart(rate: float, jitter: float, seed: int) -> None:
    stray = np.random.default_rng(seed).uniform(-jitter, jitter, 400)
    clock = read_clock((np.arange(400) + stray) / rate, str)
    assert clock.rate_hz == pytest.approx(rate, rel=2e-3)
    assert bool(clock.told) == (clock.told != ())


def test_two_columns_of_one_name_are_asked_about(tmp_path: Path) -> None:
    path = written(
        tmp_path / "a.csv", [TIME, 1e3 * X_M, FORCE_N, -FORCE_N], "Time (s),Displacement (mm),Force (N),Force (N)\n"
    )
    said = refusal(path)
    assert "2 columns are named 'Force (N)': choose one by its place, --force '#3' or --force '#4'" in said
    one = the_one(path, Choice(columns=columns(force="#4:N")))
    assert np.allclose(one.run.channels["force"], -FORCE_N, atol=1e-5)


def test_millimetres_stored_as_metres_are_refused_in_words(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", [TIME, 1e3 * X_M, FORCE_N], "Time (s),Displacement (m),Force (N)\n")
    assert "it looks like millimetres stored as metres" in refusal(path)


def test_a_velocity_in_another_unit_than_the_displacement_is_refused(tmp_path: Path) -> None:
    head = "Time (s),Displacement (mm),Velocity (m/s),Force (N)\n"
    path = written(tmp_path / "a.csv", [TIME, 1e3 * X_M, 1e3 * V_M_S, FORCE_N], head)
    assert "velocity: it is 1000 times what the displacement shows" in refusal(path)


def test_a_wrong_sample_rate_shows_beside_a_measured_velocity(tmp_path: Path) -> None:
    head = "Displacement (mm),Velocity (m/s),Force (N)\n"
    path = written(tmp_path / "a.csv", [1e3 * X_M, V_M_S, FORCE_N], head)
    the_one(path, Choice(rate_hz=500.0))
    assert "the sample rate, is wrong" in refusal(path, Choice(rate_hz=1500.0))


def test_a_last_line_that_is_cut_off_is_left_out_and_told(tmp_path: Path) -> None:
    path = good(tmp_path / "a.csv")
    whole = path.read_text()
    for cut, status in ((whole[: whole.rindex(",")], "truncated"), (whole[:-4], "complete")):
        path.write_text(cut)
        one = the_one(path)
        assert one.run.samples == SAMPLES - 1
        assert one.run.status == status
        assert np.allclose(one.run.channels["force"], FORCE_N[:-1], atol=1e-6)
        assert any("left out" in text for text in one.told)


def test_a_file_without_an_end_of_line_at_its_end_is_whole(tmp_path: Path) -> None:
    path = good(tmp_path / "a.csv")
    path.write_text(path.read_text().removesuffix("\n"))
    assert the_one(path).run.samples == SAMPLES


def test_everything_that_is_missing_is_said_at_once(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", [TIME, 1e3 * X_M, FORCE_N], "alpha,beta,gamma\n")
    said = refusal(path)
    for word in ("no displacement (or velocity)", "no force", "no time", "columns: alpha, beta, gamma"):
        assert word in said


def test_units_that_nobody_states_are_asked_for_with_the_likely_one(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", [TIME, 1e3 * X_M, FORCE_N], "Time,Stroke,Load\n")
    said = refusal(path)
    assert "--displacement 'Stroke:mm' if that is it" in said
    assert "--force 'Load:N' if that is it" in said
    one = the_one(path, Choice(columns=columns(displacement="Stroke:mm", force="Load:N")))
    assert np.allclose(one.run.channels["displacement"], X_M, atol=1e-8)
    assert "time has no unit: taken as seconds" in one.told[0]


def test_a_channel_with_holes_is_left_out_unless_it_was_asked_for(tmp_path: Path) -> None:
    table = zip(TIME.tolist(), (1e3 * X_M).tolist(), FORCE_N.tolist(), strict=True)
    lines = [f"{t:.4f},{x:.5f},{f:.4f},{25.0 if k % 10 == 0 else ''}" for k, (t, x, f) in enumerate(table)]
    path = tmp_path / "a.csv"
    path.write_text("Time (s),Displacement (mm),Force (N),Temperature (C)\n" + "\n".join(lines) + "\n")
    one = the_one(path)
    assert "temperature" not in one.run.channels
    assert any("temperature is not taken: 90 %" in text for text in one.told)
    asked = Choice(columns=columns(temperature="Temperature:C"))
    assert "line 3: temperature ('Temperature') is empty" in refusal(path, asked)


def test_a_velocity_is_integrated_where_there_is_no_displacement(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", [TIME, V_M_S, FORCE_N], "Time (s),Velocity (m/s),Force (N)\n")
    one = the_one(path)
    assert np.allclose(one.run.channels["displacement"], X_M, atol=2e-5)
    assert any("integral of the velocity" in text for text in one.told)


def test_signs_are_turned_and_means_taken_off_only_on_request(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", [TIME, 1e3 * X_M + 40.0, -FORCE_N])
    one = the_one(path)
    assert np.allclose(one.run.channels["force"], -FORCE_N, atol=1e-5)
    assert any("--centre displacement" in text for text in one.told)
    turned = the_one(path, Choice(flip=("force",), centre=("displacement",)))
    assert np.allclose(turned.run.channels["force"], FORCE_N, atol=1e-5)
    assert abs(turned.run.channels["displacement"].mean()) < 1e-12


def test_what_was_chosen_stands_in_the_run_and_reads_the_next_file(tmp_path: Path) -> None:
    from rigctl.foreign_files import choice_from
    from rigctl.runfile import read_run, write_run

    path = written(tmp_path / "a.csv", [TIME, 1e3 * X_M, -FORCE_N], "Time,Stroke,Load\n")
    first = the_one(path, Choice(columns=columns(displacement="Stroke:mm", force="Load:N"), flip=("force",)))
    write_run(tmp_path / "a.h5", first.run)
    kept = read_run(tmp_path / "a.h5").imported
    assert kept is not None
    again = the_one(path, choice_from(kept["choice"], "a.h5"))
    assert np.array_equal(again.run.channels["force"], first.run.channels["force"])
    assert kept["source"] == "a.csv"


def test_levels_of_a_staircase_become_a_run_each(tmp_path: Path) -> None:
    parts, levels = [], [(1.0, 10.0), (2.0, 10.0), (2.0, 20.0), (4.0, 5.0)]
    for frequency, amplitude in levels:
        t = np.arange(round(6 / frequency * 500)) / 500.0
        parts += [amplitude * np.sin(2 * np.pi * frequency * t), np.zeros(400)]
    x = np.concatenate(parts)
    noise = np.random.default_rng(1).normal(0.0, 0.01, x.size)
    path = written(tmp_path / "a.csv", [np.arange(x.size) / 500.0, x + noise, np.gradient(x)])
    assert any("it holds 4 levels" in text for text in the_one(path).told)
    found = import_file(path, Choice(), split=True)
    assert len(found) == len(levels)
    for one, (frequency, amplitude) in zip(found, levels, strict=True):
        assert one.run.excitation_kind == "sine"
        assert np.ptp(one.run.channels["displacement"]) == pytest.approx(2e-3 * amplitude, rel=0.02)
        cycles = one.run.samples / one.run.sample_rate_hz * frequency
        assert abs(cycles - round(cycles)) < 0.05
    assert len({one.run.run_id for one in found}) == len(levels)


def test_missing_values_are_seen_in_every_piece_of_an_array() -> None:
    import pyarrow as pa

    from rigctl.foreign_files.arrow import floats, seconds_since_first

    whole = pa.array([1.0, None, 3.0, *np.arange(20.0).tolist(), None], pa.float64())
    for start in range(5):
        piece = whole.slice(start)
        expected = np.array([np.nan if v is None else v for v in piece.to_pylist()])
        assert np.array_equal(floats(piece), expected, equal_nan=True)
    stamps = pa.array([None, 1_000_000, 3_500_000], pa.timestamp("us"))
    assert np.array_equal(seconds_since_first(stamps), [np.nan, 0.0, 2.5], equal_nan=True)


def test_reading_a_text_does_not_load_pandas(tmp_path: Path) -> None:
    import subprocess
    import sys

    code = (
        "import sys; from pathlib import Path; from rigctl.foreign_files import Choice, import_file\n"
        "import_file(Path(sys.argv[1]), Choice()); print('pandas' in sys.modules)"
    )
    path = good(tmp_path / "a.csv")
    done = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
