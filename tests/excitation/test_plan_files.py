"""Plan files hold designs: they stay small, and records are found, compared and sent."""

from __future__ import annotations

import shutil
import tracemalloc
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from excitation.design import design, design_file
from excitation.errors import DesignError, ExcitationError, ExcitationFileError
from excitation.files import read_plan, write_excitation, write_plan
from excitation.kinds import Kind
from excitation.plan import Test, TestPlan, plan_from_config
from excitation.plan_files import read_plan_config
from excitation.signal import Excitation
from tests.excitation.generators import CONFIGS, replay_config

SLOW = {"kind": "triangle", "sample_rate": 1000.0, "amplitude": 0.05, "cycles": 3}
ENDINGS = ["toml", "csv", "h5"]


def test_a_plan_of_hours_of_every_kind_is_a_small_file_and_reads_the_same_samples(tmp_path: Path) -> None:
    slow = [{**SLOW, "name": f"slow {n}", "frequency": 0.004 * n} for n in range(1, 13)]
    periods = {"multisine with current": {"periods": 300}, "homogenised": {"periods": 300}}
    other = [{**config, "name": name, **periods.get(name, {})} for name, config in CONFIGS.items()]
    plan = plan_from_config({"tests": [*slow, *other, {**replay_config(tmp_path), "name": "replay"}]})
    assert sum(test.excitation.samples for test in plan.tests) > 3_000_000
    for ending in ENDINGS:
        path = tmp_path / f"plan.{ending}"
        write_plan(path, plan)
        assert path.stat().st_size < 200_000
    for one, other_test in zip(read_plan(tmp_path / "plan.h5").tests, plan.tests, strict=True):
        made, again = other_test.excitation, one.excitation
        assert again.sources is not None
        assert (again.design, again.figures) == (made.design, made.figures)
        assert again.displacement_m.tobytes() == made.displacement_m.tobytes()
        assert (again.current_a is None) == (made.current_a is None)
        assert again.current_a is None or np.array_equal(again.current_a, made.current_a)


def series() -> TestPlan:
    """Three levels in two realisations with opposite currents, of phases that a search finds."""
    band = {"f_min": 0.5, "f_max": 20.0}
    made = design(
        "homogenised",
        {
            "sample_rate": 500.0, "period_samples": 1000, "levels": [0.2, 0.6, 1.0], "realisations": 2,
            "displacement": {**band, "max_displacement": 0.06, "max_velocity": 1.5},
            "current": {**band, "min": 0.3, "max": 1.6}, "homogenise": {"iterations": 10}, "orthogonal": True,
        },
    )  # fmt: skip
    assert isinstance(made, TestPlan)
    return made


def test_phases_that_a_search_has_found_are_kept_once_and_not_sought_again(tmp_path: Path) -> None:
    plan = series()
    write_plan(tmp_path / "plan.h5", plan)
    with h5py.File(tmp_path / "plan.h5") as file:
        assert len(file["phases"]) == 2  # the currents of the realisations are opposite
        assert not any("channels" in group for group in file["tests"].values())
    for one, made in zip(read_plan(tmp_path / "plan.h5").tests, plan.tests, strict=True):
        assert one.excitation.displacement_m.tobytes() == made.excitation.displacement_m.tobytes()
        assert one.excitation.current_a is not None
        assert np.array_equal(one.excitation.current_a, made.excitation.current_a)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda group: group.attrs.__setitem__("phases", "none"), "phases 'none' are not in the file"),
        (lambda group: group.attrs.__setitem__("samples", 7), "samples is 7: its design makes 1000"),
        (lambda group: group.attrs.__setitem__("design", '{"kind": "homogenised"}'), "sample_rate is missing"),
        (lambda group: _shorten(group.file), "its design has 40 lines"),
        (lambda group: group.file.attrs.__setitem__("format_version", 4), "this release reads up to 3"),
    ],
)
def test_a_plan_whose_designs_and_phases_do_not_agree_is_refused_in_one_line(
    change: Any, says: str, tmp_path: Path
) -> None:
    write_plan(tmp_path / "plan.h5", series())
    with h5py.File(tmp_path / "plan.h5", "r+") as file:
        change(file["tests/0000"])
    with pytest.raises(ExcitationError, match=says) as refused:
        read_plan(tmp_path / "plan.h5")
    assert "\n" not in str(refused.value)


def _shorten(file: h5py.File) -> None:
    for group in file["phases"].values():
        kept = group["displacement"][:5]
        del group["displacement"]
        group.create_dataset("displacement", data=kept).attrs["unit"] = "turn"


def test_samples_that_no_design_makes_stay_in_the_file(tmp_path: Path) -> None:
    made = plan_from_config({"tests": [{**CONFIGS["sine"], "name": "sine"}]}).tests[0].excitation
    changed = replace(made, displacement_m=0.5 * made.displacement_m)
    foreign = Excitation(
        kind=Kind.CUSTOM, sample_rate_hz=500.0, period_samples=0, displacement_m=np.arange(100) / 1e4, current_a=None
    )
    tests = tuple(Test(name=str(n), excitation=one) for n, one in enumerate((changed, foreign)))
    write_plan(tmp_path / "plan.h5", TestPlan(tests=tests))
    for one, given in zip(read_plan(tmp_path / "plan.h5").tests, tests, strict=True):
        assert one.excitation.displacement_m.tobytes() == given.excitation.displacement_m.tobytes()


def replays(folder: Path) -> TestPlan:
    """The same record from a configuration, from a file of samples and as the plan's own test."""
    folder.mkdir()
    config = replay_config(folder)
    (folder / "one.toml").write_text(
        'record = "record.h5"\nchannel = "displacement_command"\n[bounds]\nmax_displacement = 0.1\nmax_velocity = 2.0\n'
    )
    write_excitation(folder / "one.h5", design_file("replay", folder / "one.toml"))  # type: ignore[arg-type]
    own = 'test = { kind = "replay", record = "record.h5", channel = "displacement_command", bounds = '
    own += "{ max_displacement = 0.1, max_velocity = 2.0 } }\n"
    parts = ('command = "replay"\nconfig = "one.toml"\n', 'file = "one.h5"\n', own)
    (folder / "plan.toml").write_text("".join(f"[[parts]]\n{part}" for part in parts))
    assert config["record"] == str(folder / "record.h5")
    made = design_file("plan", folder / "plan.toml")
    assert isinstance(made, TestPlan)
    return made


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_plan_finds_its_records_from_anywhere_and_where_both_were_moved(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere").mkdir()
    plan = replays(tmp_path / "made")
    write_plan(tmp_path / "made" / f"played.{ending}", plan)
    monkeypatch.chdir(tmp_path / "elsewhere")
    shutil.move(tmp_path / "made", tmp_path / "moved")
    read = read_plan(Path("..") / "moved" / f"played.{ending}")
    monkeypatch.chdir(tmp_path)
    samples = [test.excitation.displacement_m for test in read.tests]
    assert samples[0].size == 8000
    assert samples[0].tobytes() == samples[1].tobytes() == samples[2].tobytes()
    record = tmp_path / "moved" / "record.h5"
    write_excitation(record, replace(read.tests[0].excitation, kind=Kind.CUSTOM))
    with pytest.raises(DesignError, match="it is not the file that the design was made of"):
        read.tests[0].excitation.displacement_m  # noqa: B018 - it is made now
    with pytest.raises(DesignError, match="SHA-256 differs") as refused:
        read_plan(tmp_path / "moved" / f"played.{ending}")
    assert str(refused.value).count(f"played.{ending}") == 1
    record.unlink()
    with pytest.raises(DesignError, match=r"played.* record .*record\.h5: no such file"):
        read_plan(tmp_path / "moved" / f"played.{ending}")


def test_a_plan_of_replays_keeps_no_samples_and_is_written_whole_where_it_is_sent(tmp_path: Path) -> None:
    plan = replays(tmp_path / "made")
    tracemalloc.start()
    try:
        plan = replace(plan, tests=tuple(replace(test, name=f"{test.name} again") for test in plan.tests))
        write_plan(tmp_path / "small.h5", plan)
        kept = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert kept < 100_000
    write_plan(tmp_path / "whole.h5", plan, whole=True)
    shutil.rmtree(tmp_path / "made")
    read = read_plan(tmp_path / "whole.h5")
    assert [test.excitation.samples for test in read.tests] == [8000, 8000, 8000]
    assert (tmp_path / "small.h5").stat().st_size < 20_000 < (tmp_path / "whole.h5").stat().st_size


@pytest.mark.parametrize("tests", [1, 4])
def test_a_plan_in_csv_that_was_cut_off_anywhere_is_refused_or_whole(tests: int, tmp_path: Path) -> None:
    warm_up = {**CONFIGS["sine"], "name": "warm"}
    every = [{**CONFIGS[kind], "name": kind, "dwell": 12.5} for kind in list(CONFIGS)[4 : 4 + tests]]
    plan = plan_from_config({"tests": every, "warm_up": warm_up})
    path = tmp_path / "plan.csv"
    write_plan(path, plan)
    content = path.read_bytes()
    whole = read_plan_config(path)
    for size in range(len(content)):
        path.write_bytes(content[:size])
        try:
            assert read_plan_config(path) == whole
        except ExcitationError as refused:
            assert "\n" not in str(refused)  # noqa: PT017 - what is whole is as good


def test_rows_of_a_plan_may_be_changed_by_hand(tmp_path: Path) -> None:
    path = tmp_path / "plan.csv"
    write_plan(path, plan_from_config({"tests": [{**CONFIGS["sine"], "name": str(n)} for n in range(3)]}))
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:3]) + "\n")
    with pytest.raises(ExcitationFileError, match=r"2 rows: line 2, rows is '3': .* correct or clear this cell"):
        read_plan(path)
    assert ",3," in lines[1]
    path.write_text(
        "\n".join([lines[0], lines[1].replace(",3,", ",,"), lines[2]])
    )  # and without an end of the last line
    assert len(read_plan(path).tests) == 2


def foreign(samples: int) -> Excitation:
    """A drive of another program: no design makes it."""
    x = np.sin(np.arange(samples) / 50.0) / 100.0
    return Excitation(kind=Kind.CUSTOM, sample_rate_hz=1000.0, period_samples=0, displacement_m=x)


@pytest.mark.parametrize("ending", ["csv", "h5", "mat"])
def test_a_file_without_a_design_is_named_by_its_path_and_its_samples_stay_in_it(ending: str, tmp_path: Path) -> None:
    drive = foreign(40_000)
    write_excitation(tmp_path / f"drive.{ending}", drive)
    (tmp_path / "all.toml").write_text(f'[[parts]]\nfile = "drive.{ending}"\nrepeats = 3\n')
    made = design_file("plan", tmp_path / "all.toml")
    assert isinstance(made, TestPlan)
    for kind in ENDINGS:
        write_plan(tmp_path / f"plan.{kind}", made)
        assert (tmp_path / f"plan.{kind}").stat().st_size < 100_000
        read = read_plan(tmp_path / f"plan.{kind}").tests[2].excitation
        assert read.sources is not None
        assert read.displacement_m.tobytes() == drive.displacement_m.tobytes()
    write_plan(tmp_path / "whole.h5", made, whole=True)
    write_excitation(tmp_path / f"drive.{ending}", foreign(39_999))
    whole = read_plan(tmp_path / "whole.h5").tests[2].excitation
    assert whole.displacement_m.tobytes() == drive.displacement_m.tobytes()
    with pytest.raises(DesignError, match="SHA-256 differs"):
        read_plan(tmp_path / "plan.toml")


def test_a_plan_of_more_than_5_mb_of_samples_is_refused_and_says_which_test_is_why(tmp_path: Path) -> None:
    tests = tuple(Test(name=f"drive {n}", excitation=foreign(n)) for n in (300_000, 400_000))
    with pytest.raises(ExcitationError, match=r"'drive 400000' keeps 3.2 MB .* plan 5.6 MB: at most 5 MB") as refused:
        write_plan(tmp_path / "plan.h5", TestPlan(tests=tests))
    assert "\n" not in str(refused.value)
    assert not list(tmp_path.iterdir())
    write_plan(tmp_path / "plan.h5", TestPlan(tests=tests), whole=True)
    write_plan(tmp_path / "one.h5", TestPlan(tests=tests[:1]))
    assert read_plan(tmp_path / "plan.h5").tests[1].excitation.samples == 400_000
