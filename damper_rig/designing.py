"""Excitations and test plans from a configuration."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from pathlib import Path

from damper_rig.progress import progress
from excitation import Envelope, Excitation, TestPlan, read_envelope
from excitation.analysis import spoiled_in
from excitation.design import design as make
from excitation.design import design_file, within_envelope
from excitation.signal import JSON

__all__ = ["DesignWarning", "design"]


class DesignWarning(UserWarning):
    """What a design cannot tell though it seems made for it."""


def design(
    command: str,
    config: Mapping[str, JSON] | str | os.PathLike[str],
    *,
    envelope: Envelope | str | os.PathLike[str] | None = None,
    scale_to_fit: bool = False,
) -> Excitation | TestPlan:
    """What `damper-rig design COMMAND` makes of a configuration: a TOML file, or a dictionary with its keys.

    ``command``: random-phase, homogenised, steps, sweep, noise, road, replay, harmonic, preset or plan. ``envelope``:
    limits of the rig in place of those that the configuration names; the design is checked against them or, with
    ``scale_to_fit``, scaled. A design whose current spoils the detection lines of its displacement, or the other way
    round, is a DesignWarning.

    Raises
    ------
    DesignError
        Where a key is wrong.
    EnvelopeError
        Where the rig cannot play it, or where there are no limits to scale to.
    """
    made = _made(command, config, envelope, scale_to_fit)
    for text in spoiled_in(made):
        warnings.warn(text, DesignWarning, stacklevel=2)
    return made


def _made(
    command: str,
    config: Mapping[str, JSON] | str | os.PathLike[str],
    envelope: Envelope | str | os.PathLike[str] | None,
    scale_to_fit: bool,
) -> Excitation | TestPlan:
    limits = envelope if envelope is None or isinstance(envelope, Envelope) else read_envelope(Path(envelope))
    with progress("designing"):
        if not isinstance(config, Mapping):
            return design_file(command, Path(config), envelope=limits, fit=scale_to_fit)
        if limits is None:
            return make(command, {**config, **({"scale_to_fit": True} if scale_to_fit else {})})
        made = make(command, {key: value for key, value in config.items() if key != "envelope"})
        return within_envelope(made, limits, fit=scale_to_fit)
