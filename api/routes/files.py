"""Files as answers, with strong ETags: the same name is the same bytes."""

from __future__ import annotations

from pathlib import Path

from fastapi.responses import FileResponse

__all__ = ["run_file"]


def run_file(path: Path, sha256: str) -> FileResponse:
    """A run file; its ETag is its SHA-256."""
    return FileResponse(path, media_type="application/x-hdf5", filename=path.name, headers={"ETag": f'"{sha256}"'})
