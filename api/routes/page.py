"""The live page and its files."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from fastapi import APIRouter
from fastapi.responses import FileResponse

from api.errors import NotFound

__all__ = ["router"]

router = APIRouter(include_in_schema=False)

_WEB = Path(__file__).parent.parent / "web"
_STATIC = {"live.js": "text/javascript", "explain.js": "text/javascript", "live.css": "text/css"}


@router.get("/", response_class=FileResponse)
def page() -> FileResponse:
    return FileResponse(_WEB / "live.html", media_type="text/html")


@router.get("/static/plotly.min.js", response_class=FileResponse)
def plotly() -> FileResponse:
    """Plotly's JavaScript from the installed package."""
    path = Path(str(files("plotly") / "package_data" / "plotly.min.js"))
    return FileResponse(path, media_type="text/javascript", headers={"Cache-Control": "max-age=86400"})


@router.get("/static/{name}", response_class=FileResponse)
def static(name: str) -> FileResponse:
    if name not in _STATIC:
        raise NotFound(f"there is no file {name!r:.60} on this page")
    return FileResponse(_WEB / "static" / name, media_type=_STATIC[name])
