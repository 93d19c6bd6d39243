"""What a service knows of a rig: what its worker says, and nothing where nobody has seen it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import Any

from api.campaigns.rig_states import Known
from api.campaigns.rigs import Rig
from api.line.service_end import Line

__all__ = ["Seen", "seen_of"]

_IDLE = (Known.FREE, Known.UNKNOWN, Known.UNREACHABLE, Known.OTHER)  # a state that "out of service" hides nothing of


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """The state of a rig in a word and a line, and when that was seen, in seconds since 1970."""

    state: str
    text: str
    at_s: float | None = None
    readings: Mapping[str, float] = field(default_factory=dict)
    progress: Mapping[str, Any] = field(default_factory=dict)  # Any: JSON, of the test that is played


def seen_of(rig: Rig, line: Line | None, again_s: float | None = None) -> Seen:
    """What is known of a rig from the line to its worker; None: no worker has been heard since the service began.

    ``again_s``: when the next worker is started after one that ended on its own, in seconds since 1970.
    """
    seen = _seen(rig, line)
    if again_s is not None and (line is None or not line.open):
        next_one = f"it is asked again at {_clock(again_s)}, or at once when its queue is resumed"
        seen = replace(seen, text=f"{seen.text}; {next_one}")
    if rig.out_of_service is not None and seen.state in _IDLE:
        text = f"{rig.out_of_service}; {seen.state}: {seen.text}"
        return Seen(state=Known.OUT_OF_SERVICE, text=text, at_s=seen.at_s, readings=seen.readings)
    return seen


def _seen(rig: Rig, line: Line | None) -> Seen:
    if line is None:
        return Seen(state=Known.UNKNOWN, text=f"nobody has asked it since the service was started{_before(rig)}")
    said = line.state
    if not line.open:
        when = _clock(line.lost_at_s or 0.0)
        why = f"ended at {when}: {line.goodbye}" if line.goodbye else f"died at {when}"
        return Seen(
            state=Known.UNKNOWN,
            text=f"its worker {why}; what the rig has done since is unknown (before: {said.get('text', '')})",
            at_s=said.get("at_s"),
        )
    progress: dict[str, Any] = {
        key: said[key] for key in ("campaign", "test", "phase", "samples", "total_samples", "fifo") if key in said
    }
    return Seen(
        state=str(said.get("state", Known.UNKNOWN)),
        text=str(said.get("text", "")),
        at_s=said.get("at_s"),
        readings=said.get("readings", {}),
        progress=progress if "test" in said else {},
    )


def _before(rig: Rig) -> str:
    return f" (at {_clock(rig.state_at_s)}: {rig.state_text})" if rig.state_at_s is not None else ""


def _clock(seconds: float) -> str:
    return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")
