"""How long a lease has not been renewed, on the steady clock of the process that waits for it.

No wall clock has a part in it, also not the database's: a clock that is set neither ends a lease nor keeps a dead one.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Lock

__all__ = ["Sightings"]

Version = tuple[str, int]  # token and number of renewals of a lease: another one after every renewal


@dataclass(slots=True)
class Sightings:
    """What one process has seen of leases. Safe to use from many threads."""

    clock: Callable[[], float] = time.monotonic
    _seen: dict[str, tuple[Version, float]] = field(default_factory=dict)  # when a version was first seen
    _lock: Lock = field(default_factory=Lock)

    def unchanged_s(self, resource: str, version: Version) -> float:
        """For how long this process has seen this version of the lease on a resource; 0 at the first sight."""
        with self._lock:
            now_s = self.clock()
            before, since_s = self._seen.get(resource, (None, now_s))
            if before != version:
                self._seen[resource] = version, now_s
                return 0.0
            return now_s - since_s

    def forget_all_but(self, resources: frozenset[str]) -> None:
        """Forget leases that are not there any more."""
        with self._lock:
            for resource in self._seen.keys() - resources:
                del self._seen[resource]
