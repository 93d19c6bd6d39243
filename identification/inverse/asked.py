"""What a user asks of an inverse: its structures, and the forward model that checks it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from identification.blackbox import Base, identify
from identification.blackbox.model import BlackBox
from identification.blackbox.modelfile import blackbox_to_json
from identification.blackbox.structure import Structure
from identification.errors import DataError
from identification.inverse.identify import inverse_runs
from identification.inverse.recipe import RECIPE, inverse_regressors
from identification.models.modelfile import Json
from identification.models.protocol import SimulationModel
from rigctl.runfile import Run


def inverse_structures(given: Sequence[str], nodes: int | None) -> list[Structure]:
    """The structures that the texts state, such as ``F0 v0 v1``; none: those that are tried by default.

    Raises DataError where nodes are stated without regressors.
    """
    if nodes is not None and not given:
        raise DataError("nodes are stated without regressors: they are those of the hidden layer")
    count = RECIPE.nodes if nodes is None else nodes
    return [Structure(inverse_regressors(text), count) for text in given]


def forward_asked(
    model: SimulationModel | None,
    file: Mapping[str, Json] | None,
    runs: Sequence[Run],
    rate_hz: float | None,
    tell: Callable[[float, str], None],
    *,
    held_out: Sequence[Run] = (),
    structures: Sequence[Structure] = (),
) -> Base:
    """The forward model that checks an inverse: the one that is given with its file, or a network of the runs."""
    if model is None or file is None:
        # What would refuse the inverse does so before a network is trained.
        inverse_runs(runs, held_out, structures=structures, rate_hz=rate_hz)
        network = identify("nnoe", runs, name="forward", rate_hz=rate_hz, tell=tell).model
        assert isinstance(network, BlackBox)  # by its kind
        return Base(network, blackbox_to_json(network))
    return Base(model, file)
