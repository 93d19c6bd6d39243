"""Libraries that only some formats need: imported when such a file comes, quiet, and with one error for all damage."""

from __future__ import annotations

import gc
import logging
import sys
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from rigctl.errors import ForeignFileError

__all__ = ["extra", "read_by_library"]


def extra(module: str, what: str) -> Any:
    """The module. Any: libraries without types. Raises ForeignFileError that names what to install."""
    try:
        return import_module(module)
    except ImportError as error:
        raise ForeignFileError(
            f"{what} files need the library {module}: install damper-rig with its extra 'files'"
        ) from error


@contextmanager
def read_by_library(what: str) -> Iterator[None]:
    """Within it a library prints nothing, and whatever it raises on a damaged file is a ForeignFileError."""
    quiet, hook = logging.root.manager.disable, sys.unraisablehook
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (ForeignFileError, MemoryError):
        raise
    except Exception as error:  # noqa: BLE001 - a library raises anything on a damaged file
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        sys.unraisablehook = lambda _: None  # half-made objects of a library fail again when they are released, here
        traceback.clear_frames(error.__traceback__)
        gc.collect()
        raise ForeignFileError(f"damaged or not a file of {what} ({reason}): save it again") from None
    finally:
        sys.unraisablehook = hook
        logging.disable(quiet)
