"""Files as answers, with strong ETags: the same name is the same bytes; and files in requests."""

from __future__ import annotations

from pathlib import Path

from fastapi import Request
from fastapi.responses import FileResponse

__all__ = ["run_file", "stated_length"]


def stated_length(request: Request) -> int:
    """The length of a body in bytes, as its sender announces it; 0 where it does not."""
    length = request.headers.get("content-length", "0")
    return int(length) if length.isdecimal() else 0


def run_file(path: Path, sha256: str) -> FileResponse:
    """A run file; its ETag is its SHA-256."""
    return FileResponse(path, media_type="application/x-hdf5", filename=path.name, headers={"ETag": f'"{sha256}"'})
