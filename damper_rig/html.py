"""HTML of results in a notebook: tables without a script, so that a stored notebook shows them anywhere."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

__all__ = ["paragraph", "table"]


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], *, raw: Sequence[int] = ()) -> str:
    """A table of text; the columns ``raw`` hold HTML already."""
    head = "".join(f"<th>{escape(one)}</th>" for one in heads)
    body = "".join(
        "<tr>"
        + "".join(f'<td style="text-align:left">{one if k in raw else escape(one)}</td>' for k, one in enumerate(row))
        + "</tr>"
        for row in rows
    )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def paragraph(text: str, *, strong: bool = False) -> str:
    inside = escape(text)
    return f"<p><b>{inside}</b></p>" if strong else f"<p>{inside}</p>"
