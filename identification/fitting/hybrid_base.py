"""What a hybrid builds on: a physical model that is given, or a simple one that is fitted."""

from __future__ import annotations

from collections.abc import Sequence

from identification.blackbox import Base
from identification.errors import DataError
from identification.fitting.base import simple_base, simple_start
from identification.physical.model import Model
from identification.physical.modelfile import model_to_json
from rigctl.runfile import Run


def base_asked(kind: str, given: Model | None, runs: Sequence[Run], *, fitted: bool = True) -> Base | None:
    """What a hybrid builds on: the model that is given, else a simple one, fitted to the runs; or not, for a check.

    Raises
    ------
    DataError
        Where a base is given for another kind.
    """
    if kind != "hybrid":
        if given is not None:
            raise DataError(f"a base is given for a black box of kind '{kind}': only a hybrid builds on one")
        return None
    simple = simple_base if fitted else simple_start
    model = simple(runs) if given is None else given
    return Base(model, model_to_json(model))
