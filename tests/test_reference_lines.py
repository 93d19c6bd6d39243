"""The lines and blocks of the README and the reference pages that neither the guides' tests nor the service's run."""

from __future__ import annotations

import csv
import json
import shutil
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from excitation import plan_from_config
from identification.models import motion_of
from rigctl.calibration import read_calibrations
from rigctl.runfile import Run, read_run, with_channel, write_run
from tests.identification.hysteretic import hysteretic
from tests.identification.multisine_runs import multisine_run
from tests.identification.packed_fmu import compiled, packed
from tests.identification.six_axes import by_formula, motion, singles_of
from tests.shown_lines import ROOT, Place, blocks, lines, listening, listening_at

DOCS = ROOT / "docs"
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Place:
    """A folder with the examples and the runs of a measured dyno, cut into one run for each speed."""
    folder = tmp_path_factory.mktemp("reference")
    shutil.copytree(ROOT / "examples", folder / "examples")
    shutil.copy(ROOT / "examples" / "dyno.csv", folder)
    here = Place(folder, "", "")
    here.does("damper-rig import dyno.csv -o cut --split --flip force")
    for name, part in (("runs", slice(1, None, 2)), ("other", slice(0, None, 2))):
        (folder / name).mkdir()
        for path in sorted((folder / "cut").glob("*.h5"))[part]:
            shutil.copy(path, folder / name / f"{path.stem}_sine.h5")
    shutil.copy(next((folder / "runs").iterdir()), folder / "run.h5")
    here.does("damper-rig fit examples/models/passive.json runs/*.h5 -o fitted.json")
    shutil.copy(ROOT / "examples" / "models" / "passive.json", folder / "simple.json")
    return here


def of(page: str, first: str = "damper-rig") -> list[str]:
    return lines(DOCS / f"{page}.md", first)


def test_import_prints_what_the_page_shows(place: Place) -> None:
    (line,) = (line for line in of("import") if "dyno.csv" in line)
    shown = next(text for text in (DOCS / "import.md").read_text(encoding="utf-8").split("```\n") if "cp1252" in text)
    assert [row.rstrip() for row in place.does(line).splitlines()] == shown.splitlines()


def written(path: Path, run: Run, flip: float = 1.0) -> None:
    """A CSV of an old archive: the force may have another sign, the displacement has an offset."""
    path.parent.mkdir(parents=True, exist_ok=True)
    x, force = run.channels["displacement"], run.channels["force"]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["Timestamp", "Displacement (mm)", "Force (N)"])
        writer.writerows(zip(np.arange(run.samples) / run.sample_rate_hz, 1e3 * x + 3.0, flip * force, strict=True))


def test_the_mapping_of_the_page_reads_its_archive(place: Place) -> None:
    whole = read_run(place.folder / "run.h5")
    archive = place.folder / "archive"
    written(archive / "a_18_18_1.csv", whole, flip=-1.0)
    written(archive / "a_20_20_1.csv", whole)
    written(archive / "sweeps" / "b.csv", whole)
    (archive / "calibration_1.csv").write_text("no table", encoding="utf-8")
    (place.folder / "lab.toml").write_text(blocks(DOCS / "import.md", "toml")[0], encoding="utf-8")
    (line,) = (line for line in of("import") if "--mapping" in line)
    place.does(line.replace("-o runs", "-o mapped"))
    mapped = place.folder / "mapped"
    made = {path.name: read_run(path) for path in mapped.rglob("*.h5")}
    assert len(list(mapped.glob("*.h5"))) == 2
    assert len(list((mapped / "sweeps").glob("*.h5"))) > 1  # split
    assert all(run.specimen == "front left" for run in made.values())
    assert all(abs(run.channels["displacement"].mean()) < 1e-6 for run in made.values())
    turned, plain = (
        next(run for name, run in made.items() if name.startswith(part)).channels["force"] for part in ("a_18", "a_20")
    )
    assert np.allclose(turned, plain)


def test_the_lines_of_the_models_page_work_one_after_the_other(place: Place) -> None:
    packed(place.folder / "supplier.fmu", compiled(place.folder), inputs=(("displacement", "mm"), ("velocity", "m/s")))
    for line in of("models"):
        place.does(line)
    assert json.loads((place.folder / "front.json").read_text(encoding="utf-8"))["paths"]["core"]
    assert (place.folder / "comparison.html").is_file()


def test_the_python_of_the_models_page_runs(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(place.folder)
    names: dict[str, object] = {"displacement": 0.01 * np.sin(np.linspace(0.0, 2.0 * np.pi, 500, endpoint=False))}
    (text,) = blocks(DOCS / "models.md", "python")
    exec(compile(text, "models.md", "exec"), names)
    assert np.shape(names["force"]) == (500,)


def test_the_lines_and_the_python_of_the_black_boxes_work(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    place.does("damper-rig identify arx runs/*.h5 -o linear.json")
    singles = singles_of(motion(1), by_formula)
    for name, one in zip(("x", "y", "z", "rx", "ry", "rz"), singles, strict=True):
        write_run(place.folder / f"{name}.h5", one)
    write_run(place.folder / "together.h5", by_formula(motion(1), "together"))
    (place.folder / "controlled").mkdir()
    for seed in (1, 2, 3):
        write_run(place.folder / "controlled" / f"{seed}.h5", hysteretic(seed, 700, current=True))
    for line in of("blackbox"):
        place.does(line)
    assert {"network.json", "simulated.h5", "six.json", "search.json", "search.html", "tracked.h5"} <= {
        p.name for p in place.folder.iterdir()
    }
    monkeypatch.chdir(place.folder)
    runs, others = ([read_run(path) for path in sorted(Path(name).glob("*.h5"))] for name in ("runs", "other"))
    names: dict[str, object] = {"runs": runs, "others": others, "motion": motion_of(others[0])}
    (text,) = blocks(DOCS / "blackbox.md", "python")
    exec(compile(text, "blackbox.md", "exec"), names)
    assert np.isfinite(np.asarray(names["force"])).all()


def test_the_tables_of_the_laboratory_are_records_and_plans(tmp_path: Path) -> None:
    sensors, plan = blocks(DOCS / "laboratory.md", "toml")
    (tmp_path / "sensors.toml").write_text(sensors, encoding="utf-8")
    (found,) = read_calibrations(tmp_path / "sensors.toml")
    assert found.sensor == "load cell 25 kN"
    read = plan_from_config(tomllib.loads(plan))
    assert [test.name for test in read.tests] == ["slow"]


def with_the_rig_that_listens(folder: Path, map_file: str, url: str) -> None:
    """The map of the example with the port of the controller that really listens."""
    path = folder / map_file
    text = path.read_text(encoding="utf-8")
    (old,) = (line for line in text.splitlines() if line.startswith("port = "))
    path.write_text(text.replace(old, f"port = {url.rsplit(':', 1)[1]}"), encoding="utf-8")


def test_a_plain_plc_plays_a_plan_by_the_lines_of_the_page(place: Place) -> None:
    sim, run = of_controllers()[:2]
    sine = {"name": "slow", "kind": "sine", "sample_rate": 100.0, "amplitude": 0.002, "frequency": 1.0, "cycles": 2}
    (place.folder / "plan.toml").write_text(
        "[[tests]]\n" + "\n".join(f"{key} = {value!r}" for key, value in sine.items()), encoding="utf-8"
    )
    for attempt in range(5):
        with listening(place.folder, *sim.replace(":5021", ":0").split()[1:]) as url:
            with_the_rig_that_listens(place.folder, "examples/rigs/plc_streamed.toml", url)
            try:
                place.does(run.replace("-o runs", "-o plc"))
                break
            except AssertionError as said:  # a busy computer stops the rig, in words: a new controller, and again
                if "ticks of the controller were missed" not in str(said) or attempt == 4:
                    raise
    ended = [read_run(path).status for path in (place.folder / "plc").glob("*.h5")]
    assert ended.count("complete") == 1  # an attempt that was stopped keeps what it measured


def of_controllers() -> list[str]:
    text = (DOCS / "controllers.md").read_text(encoding="utf-8").replace("\\\n", " ")
    return [line.removeprefix(".venv/bin/") for line in text.splitlines() if line.startswith(".venv/bin/damper-rig ")]


def test_a_record_of_a_second_instrument_is_aligned_by_the_lines_of_the_page(place: Place) -> None:
    align, sim, run = of_controllers()[2:]
    (steps,) = (text for text in blocks(DOCS / "controllers.md", "toml") if "steps.toml" in text)
    half = steps.replace("cycles = 16", "cycles = 8")  # it is played in real time
    assert half != steps
    (place.folder / "steps.toml").write_text(half, encoding="utf-8")
    free = sim.replace(":5022", ":0").replace(":5023", ":0")
    with listening_at(2, place.folder, *free.split()[1:]) as (url, amplifier):
        with_the_rig_that_listens(place.folder, "examples/instruments/amplifier.toml", amplifier)
        with_the_rig_that_listens(place.folder, "examples/rigs/motion_buffered.toml", url)
        place.does(run.replace("-o runs", "-o buffered"))
    (aligned,) = (place.folder / "buffered").glob("*-aligned.h5")
    both = read_run(aligned)
    assert np.corrcoef(both.channels["force"], both.channels["force_rig"])[0, 1] > 0.9
    (plain,) = (path for path in (place.folder / "buffered").glob("*.h5") if path != aligned)
    (place.folder / "runs" / "sine.h5").write_bytes(plain.read_bytes())
    record(place.folder / "daq.csv", read_run(plain))
    place.does(align)
    found = read_run(place.folder / "aligned.h5")
    assert np.abs(found.channels["force"] - found.channels["force_rig"]).std() < 0.2 * found.channels["force_rig"].std()
    assert "temperature" in found.channels


def record(path: Path, run: Run) -> None:
    """What a second instrument writes of the same test: its clock starts 1.5 s earlier and counts 50 ppm fast."""
    times = 1.5 + np.arange(run.samples) / run.sample_rate_hz * (1.0 + 50e-6)
    own = np.arange(0.0, times[-1] + 1.0, 1.0 / 800.0)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["time [s]", "Load [N]", "Oil [degC]", "Coil [A]"])
        shown = [np.interp(own, times, run.channels[name]) for name in ("force", "current")]
        writer.writerows(zip(own, shown[0], 25.0 + 0.1 * own, shown[1], strict=True))


def test_the_simulation_of_another_program_is_explained_by_the_line_of_the_readme(place: Place) -> None:
    (line,) = (line for line in lines(ROOT / "README.md", "damper-rig") if "--simulated" in line)
    with_force = place.folder / "runs_with_force_simulated"
    with_force.mkdir()
    for path in sorted((place.folder / "other").glob("*.h5")):
        run = read_run(path)
        v = np.gradient(run.channels["displacement"], 1.0 / run.sample_rate_hz)
        force = 3500.0 * v / (1.0 + 2.0 * np.abs(v))
        write_run(with_force / path.name, with_channel(run, "force_simulated", force, "N"))
    assert "verdict: " in place.does(line)


@pytest.fixture
def there(tmp_path: Path) -> Iterator[Place]:
    """A folder beside a simulated rig and a service."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    (tmp_path / "plan.toml").write_text(blocks(DOCS / "howto" / "campaign.md", "toml")[0], encoding="utf-8")
    with (
        listening(tmp_path, "sim", "--listen", "modbus://127.0.0.1:0", "--speed", "50") as rig,
        listening(tmp_path, "serve", "--port", "0", "--data", "lab") as service,
    ):
        yield Place(tmp_path, rig, service)


def test_a_drive_is_iterated_by_the_line_of_the_readme(there: Place) -> None:
    for first in ("damper-rig design random-phase", "damper-rig iterate"):
        there.does(next(line for line in lines(ROOT / "README.md", "damper-rig") if line.startswith(first)))
    assert list((there.folder / "iterated").glob("*.drive.h5"))


def test_the_lines_for_a_service_work_one_after_the_other(there: Place) -> None:
    def run(part: str, **names: str) -> str:
        """The one line of the page with these words, with the names of this rig and this campaign."""
        (line,) = (line for line in of("service") if part in line)
        for old, new in names.items():
            line = line.replace(old, new)
        return there.does(line)

    shutil.copy(ROOT / "deploy" / "damper-rig.toml", there.folder)
    run("--print-config")
    name = {"modbus://10.0.7.4:502": there.rig}
    campaign = json.loads(run("submit plan.toml", **{**name, "--watch": "--watch --json"}))
    run("campaign watch ID", ID=campaign["id"])
    run("campaign fetch ID", ID=campaign["id"])
    assert len(list((there.folder / "runs").glob("*.h5"))) == 2
    run("campaign list")
    assert there.rig in run("rig list")
    for line in (line for line in of("service") if line.startswith("damper-rig store")):
        there.does(line)


def test_the_python_for_a_service_plays_a_campaign(there: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(there.folder)
    (text,) = blocks(DOCS / "service.md", "python")
    here = text.replace("modbus://127.0.0.1:5020", there.rig).replace("http://127.0.0.1:8420", there.service)
    names: dict[str, object] = {}
    exec(compile(here, "service.md", "exec"), names)
    (made,) = (there.folder / "runs").glob("*.h5")
    assert read_run(made).status == "complete"


def test_the_design_of_the_analysis_page_is_made_and_its_runs_are_analysed(tmp_path: Path) -> None:
    here = Place(tmp_path, "", "")
    (tmp_path / "detection.toml").write_text(blocks(DOCS / "analysis.md", "toml")[0], encoding="utf-8")
    (tmp_path / "runs").mkdir()
    for k in range(2):
        write_run(tmp_path / "runs" / f"r{k}.h5", multisine_run(k))
    for line in of("analysis"):
        here.does(line.split(" [")[0])
    assert (tmp_path / "analysis.html").is_file()
