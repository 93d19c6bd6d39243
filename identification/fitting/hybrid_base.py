"""What a hybrid builds on: a physical model that is given, or a simple one; and what is refused before it is fitted."""

from __future__ import annotations

from collections.abc import Sequence

from identification.blackbox import Base, Layers, Structure, given
from identification.errors import DataError
from identification.fitting.base import simple_base, simple_start
from identification.physical.model import Model
from identification.physical.modelfile import model_to_json
from rigctl.runfile import Run


def base_asked(kind: str, stated: Model | None, runs: Sequence[Run], *, fitted: bool = True) -> Base | None:
    """What a hybrid builds on: the model that is given, else a simple one, fitted to the runs; or not, for a check.

    Raises
    ------
    DataError
        Where a base is given for another kind.
    """
    if kind != "hybrid":
        if stated is not None:
            raise DataError(f"a base is given for a black box of kind '{kind}': only a hybrid builds on one")
        return None
    simple = simple_base if fitted else simple_start
    model = simple(runs) if stated is None else stated
    return Base(model, model_to_json(model))


def check_asked(
    kind: str,
    runs: Sequence[Run],
    held_out: Sequence[Run] = (),
    *,
    structures: Sequence[Structure] = (),
    rate_hz: float | None = None,
    base: Model | None = None,
    layers: Layers | None = None,
) -> None:
    """Refuse what `identify` would, before minutes go into the fit of a base or a search for regressors.

    Raises
    ------
    DataError
        One line, as `identify` does.
    """
    below = base_asked(kind, base, runs, fitted=False)
    given(
        kind, runs, held_out, structures=structures, rate_hz=rate_hz, base=None if below is None else below.model,
        layers=layers,
    )  # fmt: skip
