"""Plays a plan's warm-up, unrecorded, until the damper is warm enough for a test."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

from excitation.plan import Test
from rigctl.errors import GateError, RigError, TooCold

GATE_S = 3600.0


def warmed_up(
    play: Callable[[Test, Path], Path], test: Test, out_dir: Path, warm_up: Test | None, *, gate_s: float = GATE_S
) -> Path:
    """Play a test, and the warm-up before it as often as needed; return the test's run file.

    `play` plays a test into a folder (:func:`rigctl.player.play` with everything else filled in).

    Raises
    ------
    GateError
        When the damper is still too cold after `gate_s` of warm-up; TooCold where there is no warm-up.
    RigError
        As `play` does.
    """
    spent_s = 0.0
    while True:
        try:
            return play(test, out_dir)
        except TooCold as cold:
            if warm_up is None:
                raise
            if spent_s >= gate_s:
                raise GateError(f"test {test.name!r}: {gate_s:g} s of warm-up were not enough: {cold}") from cold
        _play_unrecorded(play, warm_up)
        spent_s += warm_up.excitation.duration_s


def _play_unrecorded(play: Callable[[Test, Path], Path], warm_up: Test) -> None:
    with TemporaryDirectory(prefix="warm-up-") as folder:
        try:
            play(warm_up, Path(folder))
        except RigError as error:
            error.run_path = None  # it is deleted with the folder
            raise
