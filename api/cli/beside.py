"""A second acquisition beside a test: recorded while the test is played, aligned when it has ended."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

__all__ = ["recorded_beside"]


def recorded_beside(
    play: Callable[..., Path], instrument: Path, take: Sequence[str], pulse: str
) -> Callable[..., Path]:
    """Return what plays a test and writes NAME-aligned.h5 beside its run file, with the instrument's channels.

    A record that cannot be aligned is a warning: the test itself is whole. Any in Callable: the player's own arguments.

    Raises
    ------
    MapError, AlignmentError
        Where the map or the options are wrong, before anything moves.
    """
    from rigctl.errors import AlignmentError
    from rigctl.machines.instrument import connect_instrument

    names = {one.partition("=")[0]: one.partition("=")[2] or one for one in take}
    theirs, _, ours = pulse.partition("=")
    source = connect_instrument(str(instrument))
    known = [name for name, _ in source.channels]
    for name in (theirs, *names):
        if name not in known:
            raise AlignmentError(f"the instrument has no channel {name!r}: there are {', '.join(known)}")
    if not names:
        raise AlignmentError("--take is missing: name at least one channel of the instrument")

    def played(*words: Any, **options: Any) -> Path:
        from rigctl.machines.instrument import LiveRecord

        live = LiveRecord(source)
        try:
            with live.in_background():
                path = play(*words, **options)
            _write_aligned(path, live, names, theirs, ours or theirs)
        finally:
            source.close()
        return path

    return played


def _write_aligned(path: Path, live: Any, names: dict[str, str], theirs: str, ours: str) -> None:
    """Any: a live record; rigctl is imported only when the command runs."""
    from rigctl.errors import AlignmentError
    from rigctl.runfile import read_run, write_run
    from rigctl.second_acquisition import by_pulse, merged

    run = read_run(path)
    try:
        record = live.finish()
        found = merged(run, record, by_pulse(run, record, ours, theirs, None), names)
    except AlignmentError as error:
        print(f"damper-rig: {path}: not aligned: {error}", file=sys.stderr)
        return
    write_run(path.with_name(f"{path.stem}-aligned.h5"), found.run)
