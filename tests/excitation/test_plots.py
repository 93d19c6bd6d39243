"""Charts: one page that opens offline, with every chart that applies."""

from __future__ import annotations

from pathlib import Path

import pytest

from excitation.design import design_file
from excitation.envelope import read_envelope
from excitation.errors import ExcitationFileError
from excitation.plots import write_plots
from excitation.signal import Excitation

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(
    ("command", "name", "titles"),
    [
        (
            "random-phase",
            "random_phase",
            ["One period", "Amplitude spectrum", "Cumulative distribution", "Coverage of velocity", "Force-velocity"],
        ),
        ("harmonic", "yaw_damper_30_tests", ["30 tests"]),
    ],
)
def test_the_page_opens_offline_and_shows_every_chart(
    command: str, name: str, titles: list[str], tmp_path: Path
) -> None:
    made = design_file(command, EXAMPLES / f"{name}.toml")
    write_plots(tmp_path / "x.html", made, read_envelope(EXAMPLES / "rig_25kn.toml"))
    page = (tmp_path / "x.html").read_text()
    for title in titles:
        assert title in page
    assert page.count("plotly.js v") >= 1
    assert '<script src="http' not in page
    assert "cdn.plot.ly/plotly-" not in page.split("</script>")[-2]


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    made = design_file("random-phase", EXAMPLES / "random_phase.toml")
    assert isinstance(made, Excitation)
    with pytest.raises(ExcitationFileError, match=r"missing.*can be written"):
        write_plots(tmp_path / "missing" / "x.html", made)
    assert list(tmp_path.iterdir()) == []
