"""Draws what is hidden in a specimen, by a seed; written to a file only on request."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from excitation.atomic import written_whole
from sim_rig.effects import EFFECTS, LISTED, Scale, hidden, refusal
from sim_rig.errors import SpecimenError
from sim_rig.parameters import Damper
from sim_rig.sizes import FAINT, LARGEST, SIZES
from sim_rig.specimens import MULTI_AXIS, SPECIMENS, Specimen

RANDOM: Final = "random"
SPREAD: Final = (0.6, 1.7)  # of the usual size
START_DEGC: Final = (20.0, 30.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Hidden:
    """One effect in a specimen, with the parameters of its equation."""

    effect: str
    path: str
    listed: bool  # an element of the catalogue
    size: float  # 1: clearly visible in a good campaign
    parameters: dict[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """The true parameters of a specimen."""

    specimen: str
    seed: int
    start_degc: float
    hidden: tuple[Hidden, ...]
    damper: Damper


def draw(specimen: str, hide: Sequence[str], seed: int) -> Truth:
    """Hide effects in a specimen; ``random`` means one that a campaign can show there.

    Raises
    ------
    SpecimenError
        For a specimen or an effect that does not exist, or an effect that this specimen cannot take.
    """
    if specimen not in SPECIMENS:
        raise SpecimenError(
            f"specimen {specimen!r} does not exist: choose one of {', '.join((*SPECIMENS, *MULTI_AXIS))}"
        )
    if seed < 0:
        raise SpecimenError(f"seed is {seed}: it must be 0 or more")
    found = SPECIMENS[specimen]
    random = np.random.default_rng([seed, 0xDA3])
    start = float(random.uniform(*START_DEGC))
    damper, scale = found.damper, scale_of(found)
    done: list[Hidden] = []
    for wanted in hide:
        taken = [item.effect for item in done]
        name = str(random.choice(_visible(found, taken))) if wanted == RANDOM else wanted
        if name in taken:
            raise SpecimenError(f"effect {name!r} is asked for twice")
        size = float(np.exp(random.uniform(*np.log(SPREAD))))
        usual = SIZES[specimen].get(name, FAINT[specimen].get(name, LARGEST))
        damper, parameters = hidden(damper, name, scale, size * usual)
        effect = EFFECTS[name]
        done.append(Hidden(effect=name, path=effect.path, listed=effect.listed, size=size, parameters=parameters))
    return Truth(specimen=specimen, seed=seed, start_degc=start, hidden=tuple(done), damper=damper)


def _visible(specimen: Specimen, taken: Sequence[str]) -> list[str]:
    """Effects of the catalogue that a campaign can show on this specimen."""
    sizes, scale = SIZES[specimen.name], scale_of(specimen)
    return [
        name for name in LISTED if name in sizes and name not in taken and not refusal(specimen.damper, name, scale)
    ]


def scale_of(specimen: Specimen) -> Scale:
    """Typical force, stroke, speed and current of a specimen."""
    low, high = specimen.current_a or (0.0, 0.0)
    return Scale(
        force_n=specimen.force_rms_n,
        stroke_m=specimen.stroke_m,
        speed_m_s=specimen.speed_m_s,
        current_a=high - low,
    )


def write_truth(truth: Truth, path: Path) -> None:
    """Write what is hidden as JSON; for tests and for the demonstration."""
    content = {
        "specimen": truth.specimen,
        "seed": truth.seed,
        "start_degc": truth.start_degc,
        "hidden": [
            {
                "effect": item.effect,
                "path": item.path,
                "listed": item.listed,
                "size": item.size,
                "parameters": item.parameters,
            }
            for item in truth.hidden
        ],
        "damper": truth.damper._asdict(),
    }
    with written_whole(path, SpecimenError) as temporary:
        temporary.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
