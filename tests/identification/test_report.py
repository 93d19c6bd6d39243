"""The page of a report: drawn from its two files alone, which are read with suspicion."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from shutil import copytree

import h5py
import numpy as np
import plotly.graph_objects as go
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from api.cli.main import main
from identification.discrepancy import Explanation, explain, report_data, write_report
from identification.discrepancy.curves import page_data
from identification.errors import OutputError, ReportFileError
from identification.physical.modelfile import model_to_json
from identification.report import draw_report, read_evidence, read_report, write_evidence
from identification.report.page_data import GapMap, Interval, Words
from tests.identification.sines import sine_run
from tests.identification.specimens import AS_SIMULATED, campaign

REPRODUCE = "damper-rig explain model.json runs/*.h5 -o report"
ENOUGH = {"linear_stiffness": 9, "cogging": 5, "none": 4}  # a name, no name, no gap: with the seed of each


@cache
def explained(effect: str) -> Explanation:
    train, held = campaign(effect, seed=ENOUGH[effect])
    return explain(AS_SIMULATED, train[::2], held)  # of each kind of motion one: half the time


@pytest.fixture(params=ENOUGH)
def found(request: pytest.FixtureRequest) -> Explanation:
    return explained(request.param)


@pytest.fixture(scope="module")
def named() -> Explanation:
    return explained("linear_stiffness")


@pytest.fixture(scope="module")
def written(named: Explanation, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("written")
    write_report(named, folder, reproduce=REPRODUCE)
    return folder


@pytest.fixture
def folder(written: Path, tmp_path: Path) -> Path:
    return copytree(written, tmp_path / "report")


def same(one: object, other: object) -> bool:
    """Whether two values are equal to the bit, arrays and their types too."""
    if is_dataclass(one):
        return type(one) is type(other) and all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, np.ndarray):
        assert isinstance(other, np.ndarray)
        return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()
    if isinstance(one, tuple):
        return isinstance(other, tuple) and len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, float) and np.isnan(one):  # a curve of runs without a current has none
        return isinstance(other, float) and bool(np.isnan(other))
    return type(one) is type(other) and one == other


def test_the_page_is_the_same_to_the_byte_when_it_is_drawn_again(found: Explanation, tmp_path: Path) -> None:
    page = write_report(found, tmp_path / "one", reproduce=REPRODUCE)
    (tmp_path / "two").mkdir()
    for name in ("report.json", "evidence.h5"):
        (tmp_path / "two" / name).write_bytes((tmp_path / "one" / name).read_bytes())
    again = draw_report(tmp_path / "two")
    assert again.read_bytes() == page.read_bytes()
    assert sorted(p.name for p in again.parent.iterdir()) == ["evidence.h5", "report.html", "report.json"]
    text = page.read_text(encoding="utf-8")
    assert text.count("<h1>") == 1
    assert ("Where the simulation and the measurement disagree" in text) == (found.verdict != "no_discrepancy")


def test_evidence_comes_back_to_the_bit_and_is_small(found: Explanation, tmp_path: Path) -> None:
    data = page_data(found, reproduce=REPRODUCE)
    write_evidence(tmp_path / "evidence.h5", data)
    assert same(read_evidence(tmp_path / "evidence.h5"), data)
    assert (tmp_path / "evidence.h5").stat().st_size < 1e6


def test_the_sheet_of_the_runs_is_kept_with_the_report_where_they_are_sines(named: Explanation, tmp_path: Path) -> None:
    runs = [sine_run(lambda x, v: 900.0 * v + 40.0 * np.sign(v) + 2e3 * x, 0.02, f, noise=1.0) for f in (0.1, 1, 2, 4)]
    data = page_data(named, runs=runs)
    assert data.sheet is not None
    assert data.sheet.at_rest.friction == pytest.approx([40.0], abs=3.0)
    assert data.sheet.tests.force_rebound == pytest.approx(900.0 * data.sheet.tests.speed_rebound + 40.0, abs=5.0)
    write_evidence(tmp_path / "evidence.h5", data)
    assert same(read_evidence(tmp_path / "evidence.h5"), data)
    report = write_report(named, tmp_path, runs=runs)
    assert "The damper's characteristics" in report.read_text()
    assert page_data(named, runs=[]).sheet is None
    assert "The damper's characteristics" not in write_report(named, tmp_path / "without").read_text()


def test_an_effect_is_told_by_the_values_that_the_model_file_holds(named: Explanation) -> None:
    (effect,) = named.effects
    (own,) = [e for e in model_to_json(named.model)["paths"]["core"] if e["element"] == effect.element]
    assert effect.parameters.keys() == own["parameters"].keys() == {"k"}  # and no switch that is off


def test_a_report_says_what_was_found(named: Explanation, folder: Path) -> None:
    report, _ = read_report(folder / "report.json")
    assert report.verdict == named.verdict
    assert [e.element for e in report.effects] == ["linear_stiffness"]
    assert report.gap.held_out.closed == named.held_out.closed
    assert report.runs.train == tuple(t.record.name for t in named.traces if not t.held_out)
    assert set(named.notes) <= set(report.notes)


def test_a_thinned_run_says_how_much_of_it_is_drawn(named: Explanation, folder: Path) -> None:
    loops = read_evidence(folder / "evidence.h5").loops
    assert [loop.run for loop in loops] == [t.record.name for t in named.traces if t.held_out]
    for loop in loops:
        assert loop.measured.size == -(-loop.shown // loop.step)
        assert f"the last {loop.shown} of {loop.samples} samples" in (folder / "report.html").read_text()


texts = st.text(st.characters(exclude_categories=["Cs"]), max_size=12).map(lambda t: t.rstrip("\0"))
numbers = st.floats(width=32, allow_nan=True, allow_infinity=True)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(name=texts, notes=st.lists(texts, max_size=4), values=st.lists(numbers, min_size=6, max_size=6))
def test_any_text_and_any_number_come_back(
    name: str, notes: list[str], values: list[float], named: Explanation, tmp_path: Path
) -> None:
    gap_map = GapMap(
        displacement=np.array(values[:3]),
        velocity=np.array(values[:2]),
        mean=np.array(values, np.float32).reshape(3, 2),
    )
    words = Words(elements=tuple(notes), titles=tuple(notes), equations=tuple(notes))
    data = replace(page_data(named), name=name, aliases=tuple(notes), words=words, gap_map=gap_map,
                   train=Interval(low=np.array(values[:3]), high=np.array(values[3:])), strengths=None)  # fmt: skip
    write_evidence(tmp_path / "evidence.h5", data)
    assert same(read_evidence(tmp_path / "evidence.h5"), data)


def test_names_from_the_files_are_text_and_never_a_part_of_the_page(named: Explanation, tmp_path: Path) -> None:
    hostile = "</script><script>alert(1)</script>"
    t = named.traces[-1]
    traces = (*named.traces[:-1], replace(t, record=replace(t.record, name=hostile)))
    page = write_report(replace(named, given=replace(named.given, name=hostile), traces=traces), tmp_path)
    text = page.read_text(encoding="utf-8")
    assert "<script>alert" not in text
    assert "&lt;script&gt;alert(1)" in text


def test_evidence_is_written_whole_or_not_at_all(named: Explanation, tmp_path: Path) -> None:
    data = page_data(named)
    write_evidence(tmp_path / "evidence.h5", data)
    before = (tmp_path / "evidence.h5").read_bytes()
    unwritable = replace(data, name="a lone surrogate \ud800")
    with pytest.raises(UnicodeEncodeError):
        write_evidence(tmp_path / "evidence.h5", unwritable)
    assert (tmp_path / "evidence.h5").read_bytes() == before
    with pytest.raises(OutputError, match="cannot be written"):
        write_evidence(tmp_path / "absent" / "evidence.h5", data)
    assert [p.name for p in tmp_path.iterdir()] == ["evidence.h5"]


def test_drawing_loads_neither_the_solver_nor_the_search() -> None:
    code = (
        "import sys, identification.report; "
        "print([m for m in sys.modules if m.split('.')[0] in ('numba', 'scipy') "
        "or m.startswith(('identification.physical', 'identification.fitting', 'identification.discrepancy'))])"
    )
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[]"


def test_every_figure_of_a_page_has_the_template_as_plotly_itself_would_put_it_in(folder: Path) -> None:
    text = draw_report(folder).read_text(encoding="utf-8")
    due = json.loads(go.Figure(layout={"template": "plotly_white"}).to_json())["layout"]["template"]
    found = [json.JSONDecoder().raw_decode(rest)[0] for rest in text.split('{"template":')[1:]]
    assert len(found) == text.count('<div class="plot">') > 0
    assert all(one == due for one in found)


Change = Callable[[h5py.File], None]


def put(place: str, value: object) -> Change:
    """Another value in the place of one."""

    def change(file: h5py.File) -> None:
        del file[place]
        file[place] = value

    return change


def without(place: str) -> Change:
    def change(file: h5py.File) -> None:
        del file[place]

    return change


def said(name: str, value: object) -> Change:
    def change(file: h5py.File) -> None:
        file.attrs[name] = value

    return change


def stored_elsewhere(file: h5py.File) -> None:
    del file["spectrum/final"]
    file.create_dataset("spectrum/final", (8,), "f8", external=[("elsewhere.bin", 0, h5py.h5f.UNLIMITED)])


def virtual(file: h5py.File) -> None:
    del file["spectrum/final"]
    layout = h5py.VirtualLayout((8,), "f8")
    layout[:] = h5py.VirtualSource("elsewhere.h5", "x", (8,))
    file.create_virtual_dataset("spectrum/final", layout)


def huge(file: h5py.File) -> None:
    del file["spectrum/final"]
    file.create_dataset("spectrum/final", (10**10,), "f8", chunks=(1024,), compression="gzip")


def crowd(file: h5py.File) -> None:
    for k in range(1000):
        file.create_group(f"loops/{k + 10}")


def not_utf8(file: h5py.File) -> None:
    del file["name"]
    file.create_dataset("name", data=np.array(b"\xff\xfe", dtype=h5py.string_dtype("utf-8", 2)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (said("format", "damper-rig/run"), ["format", "damper-rig/report-evidence"]),
        (said("format_version", 2), ["format_version is 2", "update"]),
        (said("format_version", "one"), ["format_version", "positive integer"]),
        (said("format_version", 0), ["format_version", "positive integer"]),
        (said("report", 1), []),
        (without("spectrum/frequency"), ["/spectrum/frequency is missing"]),
        (without("ruled_out"), ["/ruled_out is missing"]),
        (without("loops/0"), ["/loops/0 is missing"]),
        (put("train/low", [1.0, 2.0]), ["/train", "values"]),
        (put("train/low", [[1.0, 2.0, 3.0]]), ["/train", "one row"]),
        (put("gap_map/mean", np.zeros((3, 2), np.float32)), ["/gap_map", "(3, 2)"]),
        (put("profiles/0/band", [1.0]), ["/profiles/0", "band"]),
        (put("rivals/0/left", [1.0]), ["/rivals/0", "left"]),
        (put("strengths/values", [[1.0]]), ["/strengths/values", "3 training runs"]),
        (put("base/held", [1.0]), ["/base/held", "bool is due"]),
        (put("spectrum/noise_floor", [1.0]), ["/spectrum/noise_floor", "one value"]),
        (put("spectrum/frequency", "hertz"), ["/spectrum/frequency", "float64 is due"]),
        (put("spectrum/frequency", np.zeros(0)), ["/spectrum"]),
        (put("spectrum/final", np.ones(8, dtype=[("re", "f8"), ("im", "f8")])), ["/spectrum/final", "compound"]),
        (put("spectrum/final", h5py.Empty("f8")), ["/spectrum/final", "no dataset"]),
        (put("spectrum/final", h5py.SoftLink("/spectrum/refitted")), ["/spectrum/final: a soft link"]),
        (put("spectrum", h5py.SoftLink("/nowhere")), ["/spectrum: a soft link"]),
        (put("gap_map", h5py.ExternalLink("elsewhere.h5", "/gap_map")), ["/gap_map: a link to another file"]),
        (put("name", 1.0), ["/name", "text is due"]),
        (put("name", ["one", "two"]), ["/name", "one text"]),
        (put("aliases", "one"), ["/aliases", "a list of texts"]),
        (put("loops", 1.0), ["/loops is no group"]),
        (lambda file: [file.pop("name"), file.create_group("name")], ["/name is no dataset"]),
        (stored_elsewhere, ["/spectrum/final: external storage"]),
        (virtual, ["/spectrum/final: a virtual dataset"]),
        (huge, ["/spectrum/final", "chunks"]),
        (crowd, ["/loops", "at most"]),
        (not_utf8, ["utf-8"]),
        (put("report", "another"), ["another report.json"]),
    ],
)
def test_evidence_that_cannot_be_drawn_from_is_refused_in_one_line(
    folder: Path, change: Change, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    before = (folder / "report.html").read_bytes()
    with h5py.File(folder / "evidence.h5", "r+") as file:
        change(file)
    status = main(["report", str(folder)])
    message = capsys.readouterr().err
    if not words:  # what nobody reads does no harm
        assert (status, message) == (0, "")
        return
    assert status == 2
    assert message.count("\n") == 1
    for word in (str(folder / "evidence.h5"), *words):
        assert word in message
    assert (folder / "report.html").read_bytes() == before
    assert not [p for p in folder.iterdir() if p.suffix == ".tmp"]


def test_an_object_reference_in_the_place_of_a_number_is_refused(folder: Path) -> None:
    with h5py.File(folder / "evidence.h5", "r+") as file:
        put("spectrum/final", np.array([file.ref], dtype=h5py.ref_dtype))(file)
    with pytest.raises(ReportFileError, match="/spectrum/final: of a type that is an object or region reference"):
        draw_report(folder)


@pytest.mark.parametrize(
    ("place", "value", "words"),
    [
        (("format",), "damper-rig/model", ["format", "damper-rig/discrepancy-report"]),
        (("format_version",), 2, ["format_version is 2", "update"]),
        (("format_version",), True, ["format_version", "positive integer"]),
        (("verdict",), "magic", ["verdict"]),
        (("effects", 0, "confidence"), "high", ["effects.0.confidence"]),
        (("effects", 0, "parameters", "k"), 1.0, ["effects.0.parameters.k"]),
        (("gap", "held_out", "final"), float("nan"), ["gap.held_out.final"]),
        (("gap", "train"), None, ["gap.train"]),
        (("runs", "train"), "all", ["runs.train"]),
        (("remainder", "text"), "edited", ["another report.json"]),
    ],
)
def test_a_report_that_cannot_be_drawn_is_refused_in_one_line(
    folder: Path, place: tuple[str | int, ...], value: object, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    before = (folder / "report.html").read_bytes()
    content = json.loads((folder / "report.json").read_text())
    inside = content
    for key in place[:-1]:
        inside = inside[key]
    inside[place[-1]] = value
    (folder / "report.json").write_text(json.dumps(content))
    assert main(["report", str(folder)]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    for word in (str(folder), *words):
        assert word in message
    assert (folder / "report.html").read_bytes() == before


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("report.json", None, ["report.json", "damper-rig explain"]),
        ("evidence.h5", None, ["evidence.h5", "damper-rig explain"]),
        ("report.json", b"{", ["report.json", "no JSON"]),
        ("report.json", b"[]", ["report.json", "list"]),
        ("report.json", b"\xff", ["report.json", "UTF-8"]),
        ("report.json", b"[" * 100_000, ["report.json", "no JSON"]),
        ("evidence.h5", b"not HDF5", ["evidence.h5", "HDF5"]),
    ],
)
def test_a_file_that_is_none_is_refused_in_one_line(
    folder: Path, name: str, content: bytes | None, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    if content is None:
        (folder / name).unlink()
    else:
        (folder / name).write_bytes(content)
    assert main(["report", str(folder)]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    for word in words:
        assert word in message


def test_a_file_that_is_cut_or_scrambled_anywhere_is_drawn_or_refused_and_never_breaks(folder: Path) -> None:
    whole = (folder / "evidence.h5").read_bytes()
    rng = np.random.default_rng(5)
    for _ in range(60):
        damaged = bytearray(whole[: rng.integers(1, len(whole))] if rng.random() < 0.3 else whole)
        for at in rng.integers(0, min(len(damaged), 60_000), 8):
            damaged[at] = rng.integers(256)
        (folder / "evidence.h5").write_bytes(damaged)
        with suppress(ReportFileError):  # any other error fails
            assert read_evidence(folder / "evidence.h5").loops


def test_the_command_says_where_the_page_is(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (folder / "report.html").read_bytes()
    (folder / "report.html").unlink()
    assert main(["report", str(folder), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"file": str(folder / "report.html")}
    assert (folder / "report.html").read_bytes() == before


def test_white_space_and_the_order_of_keys_do_not_matter(named: Explanation, folder: Path) -> None:
    before = (folder / "report.html").read_bytes()
    (folder / "report.json").write_text(json.dumps(report_data(named), sort_keys=True))
    assert draw_report(folder).read_bytes() == before
