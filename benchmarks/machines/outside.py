"""Effects that no element of the catalogue describes, and a filter that makes the displacement late."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from benchmarks.machines.effect import Effect, Rng, Scale, Values


def _outside(title: str, share: tuple[float, float, str], draw: Callable[[Rng, Scale, Mapping[str, float]], Values],
             *, needs_steps: bool = False) -> Effect:  # fmt: skip
    return Effect(title=title, names=(), draw=draw, share=share, needs_steps=needs_steps)


def _cog(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
    return {"cog": rng.uniform(0.08, 0.3) * scale.force_n, "cog_pitch": scale.stroke_m * rng.uniform(0.12, 0.4)}


def _power_law(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
    order = rng.uniform(0.25, 0.5)
    total = sum((0.003 * 5.0**j) ** -order for j in range(6))
    return {"power_law": rng.uniform(0.4, 1.2) * scale.force_n / scale.stroke_m / total * 2.0, "power_order": order}


def _hidden_heat(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
    seconds = rng.uniform(0.3, 1.0) * scale.seconds
    power = 0.5 * scale.force_n * scale.speed_m_s * 0.5
    return {"hot": rng.uniform(0.4, 1.2) / (power * seconds), "hot_time": seconds}


def _kick(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
    return {"kick": rng.uniform(0.3, 0.8) * scale.force_n / scale.current_a, "kick_time": rng.uniform(0.02, 0.08)}


def _cavitation(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
    return {"suction": rng.uniform(0.25, 0.6) * scale.peak_n / values["area_c"]}


COG = _outside("tooth passing", (0.08, 0.3, "rms of the force"), _cog)
POWER_LAW = _outside("rubber relaxes as a power of time", (0.4, 1.2, "rms of the force"), _power_law)
HEAT = _outside("damping fades with heat that no thermometer sees", (0.4, 1.2, "damping"), _hidden_heat)
KICK = _outside("a kick when the current jumps", (0.3, 0.8, "rms of the force"), _kick, needs_steps=True)
CAVITATION = _outside("the gas lets the oil cavitate", (0.25, 0.6, "largest force"), _cavitation)


def _clocks(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
    """Two recorders, started together: the force is late by more and more."""
    return {"skew": -rng.uniform(5e-4, 1e-3)}


def _early(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
    return {"early_hz": rng.uniform(1.2, 3.0) * scale.fastest_hz}


EARLY = replace(
    _outside("low-pass in the displacement channel", (1.2, 3.0, "motion's highest frequency"), _early),
    names=(("force_delay",), ("moving_mass",)),  # the force is early; beside a linear damper a mass does the same
)
CLOCKS = _outside("clocks of both channels differ", (5e-4, 1e-3, "time"), _clocks)
CHAIN = (replace(EARLY, weight=0.25), replace(CLOCKS, weight=0.25))
