"""The analysis of run files: what is taken of them, what is refused, and the page."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import damper_rig as dr
from api.cli.main import main
from excitation.errors import AnalysisError
from identification.analysis import analyse_levels, analyse_runs, analysis_data, analysis_html, analysis_text
from identification.analysis.charts import log_axis
from identification.errors import DataError
from rigctl.runfile import Run, write_run
from tests.identification.multisine_runs import multisine_run

Said = pytest.CaptureFixture[str]


def test_a_run_shows_its_linear_part_its_friction_and_its_asymmetry() -> None:
    found = analyse_runs([multisine_run()])
    levels = found.levels
    assert levels.odd is not None
    assert levels.even is not None
    assert levels.noise is not None
    assert levels.odd.is_seen
    assert levels.even.is_seen
    assert levels.noise.rms == pytest.approx(np.sqrt(0.5), rel=0.1)  # of half of all lines
    symmetrical = analyse_runs([multisine_run(one_sided=0.0)]).levels
    assert symmetrical.even is not None
    assert symmetrical.even.rms < 0.02 * levels.even.rms
    damping = next(one for one in found.responses if one.over == "velocity")
    assert np.all((np.abs(damping.value) > 700.0) & (np.abs(damping.value) < 1600.0))


def test_the_lines_are_those_of_the_design_and_the_same_without_it() -> None:
    run = multisine_run()
    stated, unstated = analyse_runs([run]), analyse_runs([replace(run, design=None)])
    assert np.array_equal(stated.lines.driven, unstated.lines.driven)
    assert stated.notes == unstated.notes == ()


def test_a_design_that_is_not_what_was_played_is_told_of() -> None:
    run = multisine_run()
    assert run.design is not None
    other = replace(run, design={**run.design, "seed": 99})
    found = analyse_runs([other])
    assert any("not what its design states" in note for note in found.notes)
    assert np.array_equal(found.lines.driven, analyse_runs([run]).lines.driven)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (
            lambda run: replace(run, period_samples=0, channels={k: v[:1500] for k, v in run.channels.items()}),
            "no period",
        ),
        (lambda run: replace(run, period_samples=700), "motion that repeats"),
        (lambda run: replace(run, channels={"force": run.channels["force"]}), "no channel 'displacement'"),
        (lambda run: replace(run, channels={"displacement": run.channels["displacement"]}), "no channel 'force'"),
    ],
)
def test_a_run_that_cannot_be_analysed_is_refused_in_one_line(change: object, word: str) -> None:
    with pytest.raises(DataError, match=word) as refused:
        analyse_runs([change(multisine_run())])  # type: ignore[operator]
    assert "multisine 0" in str(refused.value)


def test_runs_of_different_rates_are_refused() -> None:
    with pytest.raises(DataError, match=r"sampled at 250 Hz and multisine 0 at 500 Hz"):
        analyse_runs([multisine_run(), replace(multisine_run(1), sample_rate_hz=250.0)])


def test_a_current_that_rests_is_no_input() -> None:
    run = multisine_run()
    resting = replace(
        run, channels={**run.channels, "current": np.full(run.samples, 0.8)}, units={**run.units, "current": "A"}
    )
    assert [one.over for one in analyse_runs([resting]).responses] == ["displacement", "velocity"]


def test_a_run_that_was_cut_short_keeps_its_whole_periods_and_says_so() -> None:
    run = multisine_run()
    cut = replace(run, status="aborted", channels={name: values[:3400] for name, values in run.channels.items()})
    found = analyse_runs([cut])
    assert found.played[0].periods + found.played[0].left_out == 3
    assert "multisine 0 is aborted" in found.notes


def test_the_json_holds_numbers_text_and_null_alone() -> None:
    for runs in ([multisine_run()], [multisine_run(0), multisine_run(1)], [multisine_run(changes={"periods": 1})]):
        data = analysis_data(analyse_runs(runs))
        assert json.loads(json.dumps(data, allow_nan=False)) == data


def test_the_page_and_the_text_escape_what_a_file_says() -> None:
    found = analyse_levels([replace(multisine_run(), run_id="<script>x</script>")])
    page = analysis_html(found)
    assert "<script>x" not in page
    assert "https://" not in page.split("</script>")[-1]
    assert "odd distortion" in analysis_text(found.levels[0].found)


def test_the_command_and_the_notebook_say_the_same(tmp_path: Path, capsys: Said) -> None:
    paths = [tmp_path / f"run{k}.h5" for k in range(3)]
    for k, path in enumerate(paths):
        write_run(path, multisine_run(k))
    page = tmp_path / "page.html"
    assert main(["analyse", *map(str, paths), "-o", str(page), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    mine = dr.analyse(dr.load(*paths))
    assert {key: value for key, value in told.items() if key != "file"} == json.loads(json.dumps(mine.data()))
    assert mine.save(tmp_path / "again.html").is_file()
    assert "odd distortion" in repr(mine)
    assert {row["part"] for row in mine.rows()} >= {"linear", "odd", "even", "noise"}
    assert "<table>" in mine._repr_html_()
    assert dr.plot(mine).data
    assert main(["analyse", str(paths[0])]) == 0
    assert "linear" in capsys.readouterr().out


def _held_at(number: int, current_a: float) -> Run:
    """The run with a held current, its force the larger the higher that is."""
    run = multisine_run(number)
    channels = {"force": (1.0 + current_a) * run.channels["force"], "current": np.full(run.samples, current_a)}
    return replace(
        run,
        run_id=f"{run.run_id} at {current_a} A",
        channels={**run.channels, **channels},
        units={**run.units, "current": "A"},
    )


def _louder(number: int, factor: float) -> Run:
    return multisine_run(number, changes={"displacement": _displacement(factor)})


def _displacement(factor: float) -> dict[str, object]:
    run = multisine_run()
    assert run.design is not None
    asked = dict(run.design["displacement"])  # type: ignore[arg-type]
    return {**asked, "max_displacement": factor * 0.02, "max_velocity": factor * 0.5}


def test_each_level_and_each_held_current_is_analysed_by_itself() -> None:
    runs = [_louder(0, 0.5), _held_at(0, 0.0), _held_at(1, 0.0), _held_at(0, 0.02), _held_at(0, 1.0), _louder(1, 0.5)]
    levels = analyse_levels(runs).levels
    played = [{name for one in level.found.played for name in (one.name, *one.also)} for level in levels]
    assert played == [
        {"multisine 0", "multisine 1"},
        {"multisine 0 at 0.0 A", "multisine 0 at 0.02 A", "multisine 1 at 0.0 A"},
        {"multisine 0 at 1.0 A"},
    ]
    still, held = (level.found.levels for level in levels[1:])
    assert held.force_rms == pytest.approx(2.0 * still.force_rms, rel=0.15)
    assert levels[0].setting.displacement_rms_m < 0.6 * levels[1].setting.displacement_rms_m


def test_currents_that_differ_are_no_repetitions_of_one_another() -> None:
    with pytest.raises(DataError, match=r"mean current of 1 A and multisine 0 at 0.0 A of 0 A"):
        analyse_runs([_held_at(0, 0.0), _held_at(0, 1.0)])


def test_other_lines_and_other_rates_are_other_designs() -> None:
    lower = {**_displacement(1.0), "f_max": 12.0}
    levels = analyse_levels(
        [
            multisine_run(),
            multisine_run(1, changes={"displacement": lower}),
            replace(multisine_run(), sample_rate_hz=250),
        ]
    ).levels
    assert len(levels) == 3
    assert len({one.found.band_hz for one in levels}) == 3


def _with_current(number: int, rms_a: float) -> Run:
    current = {"f_min": 0.5, "f_max": 25.0, "lines": "odd-random", "min": 0.0, "max": 1.0}
    run = multisine_run(number, changes={"current": current})
    sizes = {"displacement": 0.002, "current": rms_a}
    return replace(run, channels={**run.channels, **{name: _of_rms(run, name, size) for name, size in sizes.items()}})


def _of_rms(run: Run, channel: str, rms: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    moving = run.channels[channel] - run.channels[channel].mean()
    return np.asarray(moving * (rms / moving.std()))


def test_currents_of_three_sizes_of_which_the_outer_ones_are_far_apart_are_more_than_one_level() -> None:
    sizes = (0.2, 0.17, 0.24, 0.2, 0.17, 0.24)
    levels = analyse_levels([_with_current(n, rms_a) for n, rms_a in enumerate(sizes)]).levels
    assert sum(len(one.found.played) for one in levels) == 6
    assert len(levels) == 2


def test_a_level_that_cannot_be_told_apart_is_named_with_its_reason_and_the_others_are_analysed(
    tmp_path: Path, capsys: Said
) -> None:
    runs = [_with_current(0, 0.2), _held_at(0, 0.0)]
    paths = [tmp_path / f"run{k}.h5" for k in range(2)]
    for path, run in zip(paths, runs, strict=True):
        write_run(path, run)
    page = tmp_path / "page.html"
    assert main(["analyse", *map(str, paths), "-o", str(page), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [one["level"]["current_mean"] for one in told["levels"]] == [0.0]
    [refused] = told["refused"]
    assert "drive the same lines and 1 realisation is given" in refused["reason"]
    assert refused["runs"] == ["run0.h5"]
    assert "1 realisation is given" in page.read_text()
    assert ", 0 ± 0.2 A rms" in page.read_text()  # the sum over a period leaves a mean of 6e-19 A
    mine = dr.analyse(dr.load(*paths))
    assert [one.runs for one in mine.found.refused] == [("run0.h5",)]
    assert "not analysed: " in repr(mine)
    assert "1 realisation is given" in mine._repr_html_()
    with pytest.raises(AnalysisError, match="drive the same lines"):
        analyse_levels(runs[:1])
    louder = replace(_with_current(1, 0.9), run_id="louder")
    with pytest.raises(AnalysisError, match="none of 2 levels can be analysed; the first: multisine 0") as raised:
        analyse_levels([runs[0], louder])
    assert "\n" not in str(raised.value)


def test_levels_are_told_drawn_and_saved_together(tmp_path: Path, capsys: Said) -> None:
    paths = [tmp_path / f"run{k}.h5" for k in range(2)]
    for path, run in zip(paths, (_held_at(0, 0.0), _held_at(0, 1.0)), strict=True):
        write_run(path, run)
    page = tmp_path / "page.html"
    assert main(["analyse", *map(str, paths), "-o", str(page), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [one["level"]["current_mean"] for one in told["levels"]] == [0.0, 1.0]
    text = page.read_text()
    assert text.count("<h2>Level ") == 2
    assert "Distortion and noise from level to level" in text
    mine = dr.analyse(dr.load(*paths))
    assert mine.data()["levels"] == told["levels"]
    assert {row["level"] for row in mine.rows()} == {one.setting.text for one in mine.levels}
    assert "level 2 of 2" in repr(mine)
    assert mine._repr_html_().startswith("<table>")
    assert dr.plot(mine).data
    with pytest.raises(DataError, match="2 levels have been analysed"):
        _ = mine.result
    assert main(["analyse", *map(str, paths)]) == 0
    assert "level 1 of 2" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "due"), [(["-o", "page.pdf"], ".html"), (["-o", "nowhere/page.html"], "nowhere"), ([], "no such file")]
)
def test_a_wrong_command_is_refused_before_it_reads(words: list[str], due: str, tmp_path: Path, capsys: Said) -> None:
    assert main(["analyse", str(tmp_path / "none.h5"), *words]) == 2
    said = capsys.readouterr().err
    assert due in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("low", "high", "marks"),
    [
        (1.5, 24.5, ["1", "2", "5", "10", "20", "50", "100", "200", "500"]),
        (9e3, 4e5, ["1\u2009000", "2\u2009000", "5\u2009000", "10\u2009000"]),
        (0.003, 5.0, ["0.001", "0.002", "0.005", "0.01"]),
        (1e-4, 100.0, ["0.0001", "0.001", "0.01", "0.1", "1", "10", "100"]),
    ],
)
def test_the_marks_of_a_logarithmic_axis_are_written_out(low: float, high: float, marks: list[str]) -> None:
    axis = log_axis(np.array([np.nan, 0.0, low, high]))
    assert axis["ticktext"][: len(marks)] == marks
    assert axis["tickvals"][0] <= low < high <= axis["tickvals"][-1]
    assert [float(text.replace("\u2009", "")) for text in axis["ticktext"]] == pytest.approx(axis["tickvals"])


@pytest.mark.parametrize("values", [[], [0.0, np.nan], [1000.0, 2200.0]])
def test_within_a_decade_the_marks_are_those_of_plotly(values: list[float]) -> None:
    assert log_axis(np.array(values)) == {"type": "log"}
