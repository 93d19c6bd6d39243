"""One BLAS thread while tasks run: they already use every processor, and their matrices are small.

With two tasks and two BLAS threads each on two processors the threads wait for each other: an identification of ten
seconds took minutes.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from threading import Lock
from typing import Any

from threadpoolctl import ThreadpoolController

_LOCK = Lock()
_LIMITS: list[Any] = []  # of all that overlap: the first one's limit, then None. Any: threadpoolctl is untyped


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Within it BLAS uses one thread; after the last of all that overlap, as many as before the first."""
    with _LOCK:
        _LIMITS.append(None if _LIMITS else _loaded().limit(limits=1, user_api="blas"))
    try:
        yield
    finally:
        with _LOCK:
            if len(_LIMITS) == 1:
                _LIMITS.pop().restore_original_limits()
            else:
                _LIMITS.pop()


def _loaded() -> ThreadpoolController:
    """The BLAS libraries of this process: numpy's and, where that has been imported, scipy's.

    What works on larger matrices with scipy imports it with its module, and so before its tasks begin.
    """
    return _found("scipy.linalg" in sys.modules)


@cache
def _found(with_scipy: bool) -> ThreadpoolController:
    """The search takes some milliseconds: once for numpy's library, and once for both."""
    return ThreadpoolController()
