"""Every row of the fault table is true on every wire; what the rig finds in itself, on two of them in turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from excitation.plan import Test
from rigctl.device import SAFE_STATES, RigState
from rigctl.errors import RigError
from rigctl.limits import Limits
from rigctl.map_table import frames_as_markdown, registers_as_markdown
from rigctl.player import PlayerSettings, play
from rigctl.progress import Progress
from rigctl.runfile import read_run
from sim_rig.errors import FaultError
from sim_rig.fault_table import FAULT_TABLE, FaultRow, as_markdown, detectors_as_markdown
from sim_rig.faults import FRAMES, FaultKind, fault_order
from tests.sim_rig.virtual import WIRES, Killable, Killed, wire_to

LIMITS = Limits(following_error_m=4e-3)
SETTINGS = PlayerSettings(ramp_s=0.3, limits=LIMITS)
AT_S = 0.5
OF_THE_WIRE = FRAMES | {FaultKind.STALLED, FaultKind.HEARTBEAT, FaultKind.BROWN_OUT}


class Watched:
    """Records, at every step of the clock, whether the rig moves."""

    def __init__(self, bench: Any) -> None:
        self.bench, self.moved_at, self.began_at, self._sleep = bench, 0.0, None, bench.clock.sleep
        bench.clock.sleep = self.sleep

    def sleep(self, seconds: float) -> None:
        self._sleep(seconds)
        controller = self.bench.rig.controller
        now = self.bench.clock.now()
        if controller.state is RigState.ACTIVE and self.began_at is None:
            self.began_at = now
        if controller.state.moving or (self.began_at is not None and not controller.at_rest):
            self.moved_at = now

    @property
    def stopped_after_s(self) -> float:
        return self.moved_at - (self.began_at or 0.0) - AT_S


def falls_silent(bench: Any, host: Killable, *, for_good: bool) -> Callable[[Progress], None]:
    """A host that sleeps for 2 s, or is killed, half a second after the start of the motion."""
    slept: list[float] = []

    def tell(progress: Progress) -> None:
        if progress.samples > (AT_S - SETTINGS.ramp_s) * 1000 and not slept:
            slept.append(bench.clock.now())
            if for_good:
                host.killed = True
                raise Killed
            bench.wait(2.0)

    return tell


def rows_on_wires() -> Iterator[Any]:
    """Every row on every wire; what no wire has a part in directly and on one of the others, on all in `make bench`.

    CAN FD, which takes longest and has the frames of CAN, is left to `make test-long`.
    """
    for k, (row, (at, wire)) in enumerate(product(FAULT_TABLE, enumerate(WIRES))):
        within_the_rig = row.order != "" and fault_order(row.order).kind not in OF_THE_WIRE
        left_out = within_the_rig and at not in (0, 1 + k // len(WIRES) % (len(WIRES) - 1))
        longer = [pytest.mark.slow] if wire == "can_fd" else []
        marks = [pytest.mark.bench] if left_out else longer
        yield pytest.param(row, wire, id=f"{row.name}-{wire}", marks=marks)


@pytest.mark.parametrize(("row", "wire"), list(rows_on_wires()))
def test_the_rig_ends_as_the_table_says(
    bench: Callable[..., Any],
    a_sine: Callable[..., Test],
    tmp_path: Path,
    row: FaultRow,
    wire: str,
) -> None:
    b = bench(speed=1.0, faults=[order_for(row, wire)] if row.order else [])
    watched, test = Watched(b), a_sine(3000 if row.within_s > 1 else 1500, frequency_hz=2.0)
    host = Killable(wire_to(wire, b.rig, b.clock))
    tell: Callable[[Progress], None] = lambda progress: None  # noqa: E731
    if not row.order:
        tell = falls_silent(b, host, for_good="killed" in row.name)
    error: BaseException | None = None
    try:
        play(host, test, tmp_path, clock=b.clock, settings=SETTINGS, on_progress=tell)
    except (RigError, Killed) as caught:
        error = caught
    b.wait(1.5)
    controller = b.rig.controller
    assert row.reads in str(error or "")
    assert (error is None) == (row.file == "complete")
    assert controller.state is row.state
    assert controller.state in SAFE_STATES
    assert controller.at_rest
    assert (b.rig.faults.frames_hit > 0) == row.name.endswith("frames")
    if row.within_s:
        assert watched.stopped_after_s <= row.within_s
    assert_inside_the_limits(b)
    if "killed" not in row.name:  # that takes a process of its own, see test_killed.py
        assert_true_file(tmp_path, row, test)


def order_for(row: FaultRow, wire: str) -> str:
    """The row's order; on classic CAN a tenth of the bad frames, since all 257 frames of a block must arrive."""
    return row.order.replace(":0.0", ":0.00") if wire == "can" else row.order


def assert_inside_the_limits(bench: Any) -> None:
    """Check the commands at every sample, and the true position of the piston."""
    commands = np.concatenate(bench.plant.commands)
    assert np.max(np.abs(commands)) <= 0.0101
    assert bench.plant.fastest_m_s() <= LIMITS.velocity_m_s
    assert np.max(np.abs(bench.plant.travelled_m)) <= LIMITS.position_max_m


def assert_true_file(folder: Path, row: FaultRow, test: Test) -> None:
    (path,) = folder.glob("*.h5")
    run = read_run(path)
    assert run.status == row.file
    due = test.excitation.samples
    assert run.samples == due if row.file == "complete" else 0 < run.samples < due
    np.testing.assert_array_equal(run.channels["displacement_command"], test.excitation.displacement_m[: run.samples])
    if row.file == "complete":
        error = run.channels["displacement"] - run.channels["displacement_command"]
        assert np.max(np.abs(error)) < 1e-3


def test_every_fault_that_can_be_ordered_is_in_the_table() -> None:
    assert {fault_order(row.order).kind for row in FAULT_TABLE if row.order} == set(FaultKind)


@pytest.mark.parametrize(
    ("page", "table"),
    [
        ("faults.md", as_markdown()),
        ("rig.md", detectors_as_markdown()),
        ("rig.md", registers_as_markdown()),
        ("rig.md", frames_as_markdown()),
    ],
    ids=["faults", "detectors", "registers", "frames"],
)
def test_the_documentation_shows_the_tables_as_they_are(page: str, table: str) -> None:
    assert table in (Path(__file__).parents[2] / "docs" / page).read_text()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("fire", "fault 'fire' does not exist"),
        ("", "fault '' does not exist"),
        ("lost:2", "share of frames is '2'"),
        ("lost@soon", "the time is 'soon'"),
        ("stalled@1:-1", "the duration is '-1'"),
        ("sensor_stuck:smell", "sensor 'smell' does not exist"),
        ("pump_trip@1:3", "takes no value"),
    ],
)
def test_an_impossible_fault_is_refused_in_one_line(text: str, words: str) -> None:
    with pytest.raises(FaultError, match=words) as caught:
        fault_order(text)
    assert "\n" not in str(caught.value)
