"""The live page and its files."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query
from fastapi.responses import FileResponse

from api.errors import NotFound

__all__ = ["router"]

router = APIRouter(include_in_schema=False)

_WEB = Path(__file__).parent.parent / "web"
_TYPES = {".js": "text/javascript", ".css": "text/css"}
_STATIC = {path.name: _TYPES[path.suffix] for path in (_WEB / "static").iterdir() if path.suffix in _TYPES}
_CHECKED = {"Cache-Control": "no-cache"}  # kept by the browser, but asked about: modules of two versions do not mix


@router.get("/", response_class=FileResponse)
def page() -> FileResponse:
    return FileResponse(_WEB / "live.html", media_type="text/html", headers=_CHECKED)


@router.get("/sign-in", response_class=FileResponse)
def sign_in(after: Annotated[str, Query(alias="next")] = "/") -> FileResponse:
    """``after``: where the page's script leads to then, on this service."""
    return FileResponse(_WEB / "sign_in.html", media_type="text/html", headers=_CHECKED)


@router.get("/static/plotly.min.js", response_class=FileResponse)
def plotly() -> FileResponse:
    """Plotly's JavaScript from the installed package."""
    path = Path(str(files("plotly") / "package_data" / "plotly.min.js"))
    return FileResponse(path, media_type="text/javascript", headers={"Cache-Control": "max-age=86400"})


@router.get("/static/{name}", response_class=FileResponse)
def static(name: str) -> FileResponse:
    if name not in _STATIC:
        raise NotFound(f"there is no file {name!r:.60} on this page")
    return FileResponse(_WEB / "static" / name, media_type=_STATIC[name], headers=_CHECKED)
