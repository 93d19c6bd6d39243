"""Parts of a laboratory are killed with SIGKILL while its rig moves, its queue is full, and its registers are watched.

    python -m benchmarks.bench_service_kills [sqlite|postgresql|both] [KILLS]

Killed are the service, the worker process of the rig, the simulated rig, the process of an explanation, the database
server (a PostgreSQL of its own, where it is installed), and the worker between a run file and its row. Another process
reads the rig's registers over a connection of its own: a motion counts as unasked where it begins after a kill and
before the operator, who is this script, resumes the queue. At each kill a campaign and a run file are being sent.

Ctrl-C, SIGTERM and SIGHUP end it with everything that it has started.
"""

from __future__ import annotations

import signal
import sys
import tempfile
import time
import traceback
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

import numpy as np

from benchmarks.service_kills.checks import look
from benchmarks.service_kills.database_server import DatabaseServer, installed
from benchmarks.service_kills.kills import KINDS, Outcome, kill_one, prepare
from benchmarks.service_kills.laboratory import Laboratory

SEED = 5
STORES = ("sqlite", "postgresql")


@dataclass(slots=True)
class Played:
    """What was found on one store; ``failed``: it could not be played to its end."""

    store: str
    found: list[Outcome] = field(default_factory=list)
    failed: bool = False

    @property
    def wrong(self) -> int:
        return sum(one.unasked + one.found.lost + one.found.left_open + one.found.temporary for one in self.found)

    def __str__(self) -> str:
        kills = [one for one in self.found if one.kind in KINDS]
        counts = ", ".join(
            f"{sum(getattr(one.found, name) for one in self.found)} {name.replace('_', ' ')}"
            for name in ("lost", "left_open", "temporary")
        )
        return (
            f"{self.store}: {len(kills)} kills, {sum(one.unasked for one in kills)} motions unasked, {counts}; "
            f"told within {max((one.told_s for one in kills), default=0.0):.1f} s, "
            f"at rest within {max((one.rest_s for one in kills), default=0.0):.1f} s"
            + ("; it could not be played to its end" if self.failed else "")
        )


def play(folder: Path, played: Played, kills: int, seed: int) -> None:
    """Kill so many parts of one laboratory, in a random order with each kind about as often."""
    programs = installed()
    with ExitStack() as stack:
        server = None
        if played.store == "postgresql":
            assert programs is not None
            tell("starts a PostgreSQL")
            server = stack.enter_context(DatabaseServer(programs, folder / "pg"))
        tell("starts rig, watcher and service")
        lab = stack.enter_context(Laboratory(folder, server))
        tell("plays a first campaign")
        explained = prepare(lab)
        kinds = [kind for kind in KINDS if kind != "database" or server is not None]
        random = np.random.default_rng(seed)
        order = random.permutation([kinds[number % len(kinds)] for number in range(kills)])
        for number, kind in enumerate(order):
            begun = time.monotonic()
            one = kill_one(lab, str(kind), explained, random)
            played.found.append(one)
            tell(
                f"{number + 1:4d} of {kills}  {one.kind:22s} told {one.told_s:6.2f} s  rest {one.rest_s:5.2f} s  "
                f"unasked {one.unasked}  took {time.monotonic() - begun:4.0f} s  {'; '.join(one.found.lines)}"
            )
        last = look(lab, everything=True)
        tell(f"at the end: {len(lab.campaigns)} campaigns, {len(lab.jobs)} jobs, {len(lab.uploads)} uploads accepted; "
             f"{last.lost} lost, {last.left_open} left open, {last.temporary} temporary; the rig was looked at "
             f"{lab.motions.looks} times and moved {len(lab.motions.begins)} times")  # fmt: skip
        played.found.append(Outcome(kind="at the end", unasked=0, told_s=0.0, rest_s=0.0, found=last))


def tell(text: str) -> None:
    print(text, flush=True)


def table(found: list[Outcome]) -> None:
    tell(f"\n{'killed':22s} kills  lost  unasked  left open  temporary  longest until told  longest until at rest")
    for kind in (*KINDS, "at the end"):
        rows = [one for one in found if one.kind == kind]
        if rows:
            tell(
                f"{kind:22s} {len(rows):5d} {sum(o.found.lost for o in rows):5d} {sum(o.unasked for o in rows):8d} "
                f"{sum(o.found.left_open for o in rows):10d} {sum(o.found.temporary for o in rows):10d} "
                f"{max(o.told_s for o in rows):17.1f} s {max(o.rest_s for o in rows):20.1f} s"
            )


def one_store(store: str, kills: int) -> Played:
    """What came of so many kills on one store."""
    tell(f"\n{store}, {kills} kills")
    played = Played(store)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        folder.chmod(0o755)  # PostgreSQL has another user
        try:
            play(folder, played, kills, SEED + STORES.index(store))
        except Exception:  # noqa: BLE001 - what was found before is shown all the same
            traceback.print_exc()
            with suppress(OSError):
                tell((folder / "serve.log").read_text()[-3000:])
            played.failed = True
    return played


def main(store: str = "both", kills: int = 6) -> None:
    """So many kills on each store. Raises SystemExit where something was lost, left or unasked."""
    if store not in (*STORES, "both"):
        raise SystemExit(f"the store is {store!r}: it must be sqlite, postgresql or both")
    if store == "postgresql" and installed() is None:
        raise SystemExit("no programs of a PostgreSQL server are installed")
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _end)
    chosen = [one for one in STORES if store in (one, "both") and (one == "sqlite" or installed() is not None)]
    played = [one_store(one, kills) for one in chosen]
    table([outcome for one in played for outcome in one.found])
    for one in played:
        tell(str(one))
    if any(one.wrong or one.failed for one in played):
        raise SystemExit(f"{sum(one.wrong for one in played)} findings")


def _end(number: int, frame: FrameType | None) -> None:
    """End everything that was started, undisturbed by further signals."""
    for other in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(other, signal.SIG_IGN)
    raise SystemExit(128 + number)


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(int, sys.argv[2:3]))
