"""One call for every file: the kind of what is saved sets the format."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Protocol

from excitation import Excitation, TestPlan, write_excitation, write_plan
from identification.physical.model import Model
from identification.physical.modelfile import write_model
from rigctl.runfile import Run, write_run

__all__ = ["Saved", "save"]


class Saved(Protocol):
    """A result that knows its file."""

    def save(self, path: str | os.PathLike[str]) -> Path: ...


def save(what: Run | Excitation | TestPlan | Model | Saved, path: str | os.PathLike[str]) -> Path:
    """Write a run, an excitation, a plan, a physical model or a result, whole or not at all; returns the path.

    An explanation is written into a folder. Raises the error of the file, one line.
    """
    place = Path(path)
    match what:
        case Run():
            write_run(place, what)
        case Excitation():
            write_excitation(place, what)
        case TestPlan():
            write_plan(place, what)
        case Model():
            write_model(place, what)
        case _:
            return what.save(place)
    return place
