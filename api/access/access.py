"""Access control of one service: the gate, the keys, the audit log and the limits, opened and closed together."""

from __future__ import annotations

from dataclasses import dataclass

from api.access.audit import AuditTrail
from api.access.gate import Gate
from api.access.keyring import Keyring
from api.access.rates import Buckets
from api.settings import Settings
from api.store.database import Database

__all__ = ["Access"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """Made with the app; ``open`` when its store is there, until then every request is refused."""

    settings: Settings
    keyring: Keyring
    gate: Gate
    trail: AuditTrail
    requests: Buckets  # of each key or address
    failures: Buckets  # wrong keys, of each address; a right key always passes: 256 bits cannot be guessed
    sign_ins: Buckets  # of each address

    @classmethod
    def of(cls, settings: Settings) -> Access:
        keyring = Keyring()
        per_s = settings.requests_per_s
        return cls(
            settings=settings,
            keyring=keyring,
            gate=Gate(keyring, keys_required=settings.access == "keys"),
            trail=AuditTrail(),
            requests=Buckets(per_s=per_s, burst=2 * per_s),
            failures=Buckets(per_s=0.5, burst=30),
            sign_ins=Buckets(per_s=1 / 6, burst=10),
        )

    def open(self, database: Database) -> None:
        """Read the keys and start what runs in the background. Raises StoreError."""
        self.keyring.open(database)
        self.trail.open(database)

    def close(self) -> None:
        self.keyring.close()
        self.trail.close()
