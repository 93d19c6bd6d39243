"""A device that is no rig, or speaks another map: one line, and nothing moves."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from api.cli.main import main
from rigctl.address import connect
from tests.api.rigs import a_sim, said_in_one_line

RIGS = ("modbus://127.0.0.1:0", "can://loopback/cli-{}", "can://loopback/cli-{}?fd=true")


@pytest.mark.parametrize("command", ["run", "iterate"])
@pytest.mark.parametrize("url", RIGS)
@pytest.mark.parametrize(("what", "words"), [("MAGIC", "a foreign device"), ("MAP_VERSION", "speaks register map 3")])
def test_a_foreign_device_and_another_map_are_one_line_and_no_motion(
    road: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    sims: dict[str, str],
    url: str,
    command: str,
    what: str,
    words: str,
) -> None:
    from rigctl import modbus_map

    with monkeypatch.context() as patch:
        patch.setattr(modbus_map, what, 0x77)
        assert main([command, "road.h5", "--rig", sims[url], "-o", "runs"]) == 1
    assert words in said_in_one_line(capsys)
    wire = connect(sims[url])
    status = wire.status(2.0)
    wire.close()
    assert (status.state.name, status.consumed) == ("DISABLED", 0)
    assert abs(status.displacement_m) < 1e-4
    assert not list(road.glob("runs/*"))


@pytest.fixture(scope="module")
def sims() -> Iterator[dict[str, str]]:
    can_fd = RIGS[2].replace("cli", "cli-fd")
    soon = ("--speed", "20")  # a rig in real time takes a tenth of a core while it waits
    with a_sim(RIGS[0], *soon) as one, a_sim(RIGS[1], *soon) as two, a_sim(can_fd, *soon) as three:
        yield dict(zip(RIGS, (one, two, three), strict=True))
