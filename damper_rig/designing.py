"""Excitations and test plans from a configuration."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from damper_rig.progress import progress
from excitation import Envelope, Excitation, TestPlan, read_envelope
from excitation.design import design as make
from excitation.design import design_file, within_envelope
from excitation.signal import JSON

__all__ = ["design"]


def design(
    command: str,
    config: Mapping[str, JSON] | str | os.PathLike[str],
    *,
    envelope: Envelope | str | os.PathLike[str] | None = None,
    scale_to_fit: bool = False,
) -> Excitation | TestPlan:
    """What `damper-rig design COMMAND` makes of a configuration: a TOML file, or a dictionary with its keys.

    ``command``: random-phase, homogenised or harmonic. ``envelope``: limits of the rig in place of those that the
    configuration names; the design is checked against them or, with ``scale_to_fit``, scaled.

    Raises
    ------
    DesignError
        Where a key is wrong.
    EnvelopeError
        Where the rig cannot play it, or where there are no limits to scale to.
    """
    limits = envelope if envelope is None or isinstance(envelope, Envelope) else read_envelope(Path(envelope))
    with progress("designing"):
        if not isinstance(config, Mapping):
            return design_file(command, Path(config), envelope=limits, fit=scale_to_fit)
        if limits is None:
            return make(command, {**config, **({"scale_to_fit": True} if scale_to_fit else {})})
        made = make(command, {key: value for key, value in config.items() if key != "envelope"})
        return within_envelope(made, limits, fit=scale_to_fit)
