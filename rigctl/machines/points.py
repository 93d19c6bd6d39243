"""Values of a controller by their roles, over a wire."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from rigctl.machines.roles import Role


class Points(Protocol):
    """Reads and writes values in SI units. Every call ends by `ends` on the clock; only TransportError is raised."""

    @property
    def url(self) -> str: ...

    @property
    def roles(self) -> frozenset[Role]:
        """Roles that have a place in the map."""
        ...

    @property
    def pending(self) -> int:
        """Sets of values that `read_next` returns without waiting."""
        ...

    def read(self, roles: Sequence[Role], ends: float) -> dict[Role, float]: ...

    def read_next(self, roles: Sequence[Role], ends: float) -> dict[Role, float]:
        """Like `read`; a wire on which the controller sends by itself returns its next frames, in their order."""
        ...

    def write(self, values: Mapping[Role, float], ends: float) -> None: ...

    def read_array(self, role: Role, count: int, ends: float) -> list[float]: ...

    def write_array(self, role: Role, values: Sequence[float], ends: float) -> None: ...

    def close(self) -> None: ...
