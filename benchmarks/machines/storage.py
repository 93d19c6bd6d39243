"""A case on disk: the input of the workflow as run files and a model file, and the truth beside it."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machines.case import Case
from rigctl.runfile import write_run


def write_case(case: Case, directory: str | os.PathLike[str]) -> Path:
    """Write model.json, train_*.h5, held_*.h5, truth.json and the true forces truth_*.npy; return the folder."""
    folder = Path(directory)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.json").write_text(json.dumps(case.base_model, indent=1), encoding="utf-8")
    for name, runs in (("train", case.runs), ("held", case.held_out)):
        for number, run in enumerate(runs):
            write_run(folder / f"{name}_{number}.h5", run)
    for number, force in enumerate(case.truth):
        np.save(folder / f"truth_{number}.npy", force)
    (folder / "truth.json").write_text(json.dumps(truth_of(case), indent=1), encoding="utf-8")
    return folder


def truth_of(case: Case) -> Mapping[str, Any]:
    """Everything of a case but its samples, as JSON values."""
    return {
        "seed": case.seed,
        "kind": case.kind,
        "hidden": [{**asdict(h), "identifiable": h.identifiable} for h in case.hidden],
        "identifiable": case.identifiable,
        "form": list(case.form),
        "form_excess": case.form_excess,
        "runs": len(case.runs),
        "held_out": len(case.held_out),
        "samples": sum(r.samples for r in (*case.runs, *case.held_out)),
        "own_choice": case.own_choice,
        "noise_n": case.noise_n,
        "force_n": case.force_n,
        "excess": case.excess,
        "detail": dict(case.detail),
    }
