"""What README and guides show of service, rig and FMU: every such line runs, on one rig and one service for all."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Mapping

import pytest

from tests.identification.packed_fmu import INPUTS, compiled, packed
from tests.shown_lines import ROOT, Place, blocks, lines, listening

HOWTO = ROOT / "docs" / "howto"


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Place]:
    folder = tmp_path_factory.mktemp("lines")
    shutil.copytree(ROOT / "examples", folder / "examples")
    shutil.copy(ROOT / "examples" / "models" / "passive.json", folder / "model.json")
    (folder / "plan.toml").write_text(blocks(HOWTO / "campaign.md", "toml")[0])
    inputs = (("s_rel", "mm"), INPUTS[1])  # of a passive damper: no current
    packed(folder / "damper.fmu", compiled(folder), inputs=inputs)
    with (
        listening(folder, "sim", "--listen", "modbus://127.0.0.1:0", "--speed", "50") as rig,
        listening(folder, "serve", "--port", "0", "--data", "lab") as service,
    ):
        yield Place(folder, rig, service)


@pytest.fixture(scope="module")
def campaign(place: Place) -> Mapping[str, str]:
    """The campaign of the guide, played to its end by the line of the guide."""
    (submit,) = (line for line in lines(HOWTO / "campaign.md", "damper-rig") if " submit " in line)
    return json.loads(place.does(f"{submit} --json"))


@pytest.mark.slow
def test_a_plan_is_played_with_and_without_a_service(place: Place, campaign: Mapping[str, str]) -> None:
    (run,) = (line for line in lines(HOWTO / "campaign.md", "damper-rig") if line.startswith("damper-rig run"))
    place.does(run)
    assert len(list((place.folder / "runs").glob("*.h5"))) == 2
    assert campaign["state"] == "done"


@pytest.mark.slow
def test_every_curl_line_of_readme_and_guide_is_accepted(place: Place, campaign: Mapping[str, str]) -> None:
    place.does(f"damper-rig campaign fetch {campaign['id']} -o fetched")
    first, *_ = sorted((place.folder / "fetched").glob("*.h5"))
    shutil.copy(first, place.folder / "front.h5")
    tests = [{"name": "sine", "kind": "sine", "sample_rate": 1000.0, "amplitude": 0.005, "frequency": 4.0, "cycles": 4}]
    (place.folder / "campaign.json").write_text(
        json.dumps({"name": "one", "specimen": "a", "rig": place.rig, "tests": tests})
    )
    shown = [*lines(ROOT / "README.md", "curl"), *lines(HOWTO / "http.md", "curl")]
    assert len(shown) == 5
    for line in shown:
        answer = json.loads(place.does(line, ID=campaign["id"]))
        assert answer["id"], line


@pytest.mark.slow
def test_every_line_with_an_fmu_explains_it(place: Place) -> None:
    shown = [
        line for page in (ROOT / "README.md", HOWTO / "fmu.md") for line in lines(page, "damper-rig") if ".fmu" in line
    ]
    assert len(shown) >= 2
    assert len({line.split("#")[0].strip() for line in shown}) == 1  # one line in both places: it runs once
    for path in (place.folder / "runs").glob("*.h5"):
        path.unlink()  # of another damper
    place.does("damper-rig import examples/dyno.csv -o runs --split --flip force")
    said = place.does(shown[0])
    assert "verdict: " in said
    assert (place.folder / "report" / "report.html").is_file()
