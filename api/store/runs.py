"""Where run files are kept: the only place that knows, so that an object storage can take it over."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from api.campaigns.records import RunRecord
from api.errors import NotFound
from rigctl.runfile import Run, read_run

__all__ = ["RunFiles"]


@dataclass(frozen=True, slots=True)
class RunFiles:
    """Run files below one folder, a folder for each campaign. A ``location`` is a path relative to it."""

    root: Path

    def work_dir(self, campaign_id: str) -> Path:
        """Where a worker captures the runs of a campaign."""
        return self.root / campaign_id

    def keep(self, path: Path, *, campaign_id: str, held_out: bool) -> RunRecord:
        """Take over a closed run file and return what the store must know of it; raises RunFileError."""
        run = read_run(path)
        with path.open("rb") as file:
            sha256 = hashlib.file_digest(file, "sha256").hexdigest()
        return _record(run, campaign_id, held_out, path.relative_to(self.root), path.stat().st_size, sha256)

    def local(self, record: RunRecord) -> Path:
        """A path on this machine, good for one request or one job; raises NotFound where the file is gone."""
        return self.at(record.location)

    def at(self, location: str) -> Path:
        """The same for a location alone."""
        path = self.root / location
        if not path.is_file():
            raise NotFound(f"a run file is gone from the run files: restore {location}")
        return path


def _record(run: Run, campaign_id: str, held_out: bool, location: Path, size_bytes: int, sha256: str) -> RunRecord:
    return RunRecord(
        id=run.run_id,
        campaign_id=campaign_id,
        test=run.test_id,
        held_out=held_out,
        status=run.status,
        location=location.as_posix(),
        size_bytes=size_bytes,
        sha256=sha256,
        samples=run.samples,
        sample_rate_hz=run.sample_rate_hz,
        created=run.created,
    )
