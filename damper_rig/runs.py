"""Measured runs in the order in which they were given."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import overload

from damper_rig.html import table
from identification.models.simulation import name_of
from rigctl.runfile import Run

__all__ = ["Runs", "listed"]

_HEADS = ("run", "specimen", "kind", "samples", "rate, Hz", "length, s", "channels")


@dataclass(frozen=True, slots=True)
class Runs(Sequence[Run]):
    """Runs as a sequence; a slice of it is one too."""

    runs: tuple[Run, ...]

    def __len__(self) -> int:
        return len(self.runs)

    @overload
    def __getitem__(self, at: int) -> Run: ...
    @overload
    def __getitem__(self, at: slice) -> Runs: ...
    def __getitem__(self, at: int | slice) -> Run | Runs:
        return Runs(self.runs[at]) if isinstance(at, slice) else self.runs[at]

    def __iter__(self) -> Iterator[Run]:
        return iter(self.runs)

    def rows(self) -> list[dict[str, object]]:
        """What each run is, a dictionary each."""
        return [
            {
                "run": name_of(run),
                "specimen": run.specimen,
                "excitation_kind": run.excitation_kind,
                "status": run.status,
                "test_id": run.test_id,
                "samples": run.samples,
                "sample_rate": run.sample_rate_hz,
                "channels": list(run.channels),
            }
            for run in self.runs
        ]

    def __repr__(self) -> str:
        return "\n".join([f"{len(self)} run{'s' * (len(self) != 1)}", *("  ".join(row) for row in self._cells())])

    def _repr_html_(self) -> str:
        return table(_HEADS, self._cells())

    def _cells(self) -> Iterator[tuple[str, ...]]:
        for run in self.runs:
            yield (
                name_of(run), run.specimen, run.excitation_kind, str(run.samples), f"{run.sample_rate_hz:.6g}",
                f"{run.samples / run.sample_rate_hz:.4g}", ", ".join(run.channels),
            )  # fmt: skip


def listed(given: Run | Iterable[Run]) -> list[Run]:
    """The runs as a list, one run as a list of one."""
    return [given] if isinstance(given, Run) else list(given)
