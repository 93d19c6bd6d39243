"""Where reports are kept: the only place that knows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from api.campaigns.records import Explanation, ExplanationState
from api.errors import Conflict, NotFound

__all__ = ["Reports"]


@dataclass(frozen=True, slots=True)
class Reports:
    """Report folders below one folder, one for each explanation."""

    root: Path

    def work_dir(self, explanation_id: str) -> Path:
        """Where the report of an explanation is written."""
        return self.root / explanation_id

    def local(self, asked: Explanation, name: str) -> Path:
        """A file of a report; raises Conflict where there is no report yet, NotFound where the file is gone."""
        if asked.state is not ExplanationState.DONE:
            why = f": {asked.reason}" if asked.reason else ""
            raise Conflict(f"explanation {asked.id} is {asked.state}{why}: only one that is done has a report")
        path = self.work_dir(asked.id) / name
        if not path.is_file():
            raise NotFound(f"{name} of explanation {asked.id} is gone from the reports: ask for it again")
        return path
