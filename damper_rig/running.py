"""How long work runs: on the executor that the environment names, with one BLAS thread, its progress shown."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

from threadpoolctl import threadpool_limits

from damper_rig.progress import Tell, progress
from identification.compute import chosen

__all__ = ["working"]


@contextmanager
def working(text: str) -> Iterator[Tell]:
    """As every command runs it: on small matrices several BLAS threads take three times as long and round differently.

    Raises ComputeError where the environment names no usable executor.
    """
    with threadpool_limits(1, user_api="blas"), chosen(os.environ), progress(text) as tell:
        yield tell
