"""What a key allows: four scopes, each with everything that the one before it allows."""

from __future__ import annotations

from enum import StrEnum

__all__ = ["Scope"]


class Scope(StrEnum):
    """One step of the ladder read ⊂ schedule ⊂ operate ⊂ admin.

    read      look: campaigns, rigs, runs, results, live samples
    schedule  submit campaigns, jobs and files, cancel jobs; end a campaign (stop, abort, make safe)
    operate   everything after which a rig may move: hold, resume, answer a question; queues and reservations
    admin     keys, the audit log, which rigs there are and their envelopes and interlocks

    Stop stands low on purpose: whoever can put a test into the queue must be able to end one. It can move nothing.
    """

    READ = "read"
    SCHEDULE = "schedule"
    OPERATE = "operate"
    ADMIN = "admin"

    def includes(self, needed: Scope) -> bool:
        """Whether a key of this scope may do what ``needed`` stands for."""
        return _LADDER.index(self) >= _LADDER.index(needed)


_LADDER = tuple(Scope)
