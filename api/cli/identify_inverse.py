"""``damper-rig identify inverse``: the current from motion and wanted force, learned from measured runs."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from identification.blackbox import Base
    from identification.blackbox.structure import Structure
    from rigctl.runfile import Run

__all__ = ["identify_inverse", "refuse_select"]

_FORWARD = 0.5  # share of the time for a forward model, where none is given


def identify_inverse(
    runs: Sequence[Path],
    held_out: Sequence[Path],
    output: Path,
    regressors: Sequence[str],
    nodes: int | None,
    rate_hz: float | None,
    base: Path | None,
    *,
    as_json: bool,
) -> None:
    """Learn an inverse, check it by tracking the measured force, write it and print its figures."""
    from api.cli.terminal import answer, progress_bar, warn
    from identification.compute import chosen
    from identification.inverse import identify_inverse as identified
    from identification.inverse import inverse_data, inverse_structures, inverse_text, write_inverse
    from identification.measured import read_runs

    structures = inverse_structures(regressors, nodes)
    every = read_runs([*runs, *held_out], once=True)
    measured, shown = every[: len(runs)], every[len(runs) :]
    with chosen(os.environ), progress_bar("identifying") as tell:
        forward = _forward(
            base, measured, shown, structures, rate_hz,
            lambda done, text: tell(_FORWARD * done, f"forward model: {text}"),
        )  # fmt: skip
        result = identified(
            measured, forward, held_out=shown, name=output.stem, structures=structures, rate_hz=rate_hz,
            tell=lambda done, text: tell(_FORWARD + (1.0 - _FORWARD) * done, text),
        )  # fmt: skip
    warn(every)  # only now: a refusal is one line
    write_inverse(output, result.model)
    answer(f"{output}: {inverse_text(result)}", {"file": str(output), **inverse_data(result)}, as_json=as_json)


def refuse_select(given: bool) -> None:
    """Raise InputError where a search for regressors is asked for."""
    from api.errors import InputError

    if given:
        raise InputError("--select and what goes with it are for a model of the force: an inverse takes --regressors")


def _forward(
    given: Path | None,
    runs: Sequence[Run],
    held_out: Sequence[Run],
    structures: Sequence[Structure],
    rate_hz: float | None,
    tell: Callable[[float, str], None],
) -> Base:
    """The forward model that checks the inverse."""
    import json

    from api.errors import InputError
    from identification.inverse import forward_asked
    from identification.models import load_model

    if given is None:
        return forward_asked(None, None, runs, rate_hz, tell, held_out=held_out, structures=structures)
    model = load_model(given)
    if model.kind == "fmu":
        raise InputError(f"{given}: an FMU has no place in a model file: give a JSON model, or invert it: track")
    return forward_asked(model, json.loads(given.read_text(encoding="utf-8")), runs, rate_hz, tell)
