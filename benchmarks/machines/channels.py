"""Effects of the recording chain: they look like a machine, and are none."""

from __future__ import annotations

from collections.abc import Mapping

from benchmarks.machines.effect import Effect, Rng, Scale, Values


def zero(low: float = 0.05, high: float = 0.25) -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        zero = rng.uniform(low, high) * scale.force_n * float(rng.choice([-1.0, 1.0]))
        return {"zero_n": zero, "wander_n": abs(zero) * rng.uniform(0.0, 0.15)}

    return Effect(
        title="load cell not tared", names=(("force_offset",),), draw=draw, share=(low, high, "rms of the force"),
        excludes=frozenset({"gas behind the rod"}), weight=0.6,
    )  # fmt: skip


def low_pass() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {"filter_hz": min(rng.uniform(1.5, 5.0) * scale.fastest_hz, 0.45 * scale.rate_hz)}

    names = (("force_delay",), ("series_compliance",))
    return Effect(
        title="low-pass in the force channel", names=names, draw=draw, share=(1.5, 5.0, "motion's highest frequency"),
        excludes=frozenset({"force channel late"}), weight=0.6,
    )  # fmt: skip


def late() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {"delay_s": rng.uniform(0.5, 2.0) / scale.rate_hz}

    names = (("force_delay",), ("series_compliance",))
    return Effect(
        title="force channel late", names=names, draw=draw, share=(0.5, 2.0, "samples"),
        excludes=frozenset({"low-pass in the force channel"}), weight=0.6,
    )  # fmt: skip


def drift() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {"drift_n_s": rng.uniform(0.05, 0.2) * scale.force_n / scale.seconds * float(rng.choice([-1.0, 1.0]))}

    return Effect(
        title="amplifier drifts", names=(("force_drift",),), draw=draw, share=(0.05, 0.2, "rms of the force, in a run"),
        weight=0.4,
    )  # fmt: skip


def mains() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {"hum_n": rng.uniform(0.03, 0.12) * scale.force_n, "hum_hz": float(rng.choice([50.0, 60.0]))}

    return Effect(
        title="mains in the force channel", names=(("mains_hum",),), draw=draw, share=(0.03, 0.12, "rms of the force"),
        weight=0.3, least_rate_hz=150.0,
    )  # fmt: skip


CHAIN = (zero(), low_pass(), late(), drift(), mains())
