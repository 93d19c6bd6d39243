"""``damper-rig identify multiaxis``: the loads of several axes, from tests of one axis each or of all together."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

__all__ = ["identify_axes", "refuse_structure"]

_BASE = 0.3  # share of the time for the base of the main axis


def identify_axes(
    runs: Sequence[Path],
    held_out: Sequence[Path],
    output: Path,
    rate_hz: float | None,
    base: Path | None,
    *,
    as_json: bool,
) -> None:
    """Learn the loads of several axes, write the model and print its figures."""
    from api.cli.terminal import answer, progress_bar, warn
    from identification.compute import chosen
    from identification.fitting.axes_base import axes_base
    from identification.measured import read_runs
    from identification.multiaxis import (
        axes_data,
        axes_text,
        check_multiaxis,
        identify_multiaxis,
        main_axis_runs,
        write_multiaxis,
    )
    from identification.physical.modelfile import read_model

    below = None if base is None else read_model(base)
    read = read_runs([*runs, *held_out], once=True)
    measured, shown, _ = check_multiaxis(read[: len(runs)], read[len(runs) :], rate_hz=rate_hz)
    main = main_axis_runs(measured)
    with chosen(os.environ), progress_bar("identifying") as tell:
        tell(0.0, "base of the main axis")
        under = axes_base(below, main) if main else None
        result = identify_multiaxis(
            measured,
            held_out=shown,
            base=under,
            name=output.stem,
            tell=lambda done, text: tell(_BASE + (1.0 - _BASE) * done, text),
        )
    warn([*main, *shown])  # a test of another axis holds the main one still; only now: a refusal is one line
    write_multiaxis(output, result.model)
    answer(f"{output}: {axes_text(result)}", {"file": str(output), **axes_data(result)}, as_json=as_json)


def refuse_structure(given: object) -> None:
    """Raise InputError where a structure, layers or a search is asked for."""
    from api.errors import InputError

    if given:
        raise InputError("multiaxis: axes are chosen by correlation: leave out regressors, nodes, layers and searches")
