"""Progress of long work: a bar below the cell of a notebook; nothing in a script."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from typing import Any, Final

__all__ = ["Tell", "in_notebook", "progress"]

Tell = Callable[[float, str], None]  # told the share that is done, and what is being done

_EVERY_S: Final = 0.2  # at most five updates a second: a browser that is far away follows them


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return shell is not None and hasattr(shell, "kernel")


@contextmanager
def progress(text: str) -> Iterator[Tell]:
    """What is told of the work within is shown until it ends."""
    if not in_notebook():
        yield lambda done, text: None
        return
    shown = _display().display(_Bar(text, 0.0), display_id=True)
    last = time.monotonic()

    def tell(done: float, text: str) -> None:
        nonlocal last
        if time.monotonic() - last >= _EVERY_S:
            last = time.monotonic()
            shown.update(_Bar(text, done))

    try:
        yield tell
    finally:
        shown.update(_Bar("", 1.0))


class _Bar:
    """One state of the bar; without a text it shows nothing."""

    def __init__(self, text: str, done: float) -> None:
        self._text, self._done = text, done

    def __repr__(self) -> str:
        return f"{self._text} {100 * self._done:.0f} %" if self._text else ""

    def _repr_html_(self) -> str:
        if not self._text:
            return ""
        return f'<progress max="1" value="{self._done:.3f}"></progress> {escape(self._text)}'


def _display() -> Any:  # Any: IPython is there only in a notebook
    import IPython.display

    return IPython.display
