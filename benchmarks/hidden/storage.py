"""Writes a case: the input of the workflow, and the truth for the evaluation."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np

from benchmarks.hidden.case import Case
from rigctl.runfile import write_run


def write_case(case: Case, directory: str | os.PathLike[str]) -> Path:
    """Write model.json, train_*.h5, held_*.h5, truth_*.npy and truth.json; return the directory."""
    folder = Path(directory)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.json").write_text(json.dumps(case.base_model, indent=1), encoding="utf-8")
    for name, runs in (("train", case.runs), ("held", case.held_out)):
        for number, run in enumerate(runs):
            write_run(folder / f"{name}_{number}.h5", run)
    for number, force in enumerate(case.truth):
        np.save(folder / f"truth_held_{number}.npy", force)
    (folder / "truth.json").write_text(json.dumps(truth_of(case), indent=1), encoding="utf-8")
    return folder


def truth_of(case: Case) -> dict[str, object]:
    """Everything about a case except its samples, as JSON values."""
    return {
        "seed": case.seed,
        "kind": case.kind,
        "effects": list(case.effects),
        "noise_n": case.noise_n,
        "excess": case.excess,
        "excess_each": list(case.excess_each),
        "mismatch": case.mismatch,
        "detail": case.detail,
    }
