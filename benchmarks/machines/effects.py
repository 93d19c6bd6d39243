"""Effects of machines, in the sizes that occur: shares of the force, of the stroke, of the current."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from benchmarks.machines.effect import Effect, Names, Rng, Scale, Values

FRICTION: tuple[Names, ...] = (
    ("coulomb_friction",), ("presliding_friction",), ("stribeck_friction",), ("lugre_friction",),
)  # fmt: skip
CURVES: tuple[Names, ...] = (
    ("relief_valve",), ("arctan_damping",), ("piecewise_linear_damping",), ("valve_damping",), ("quadratic_damping",),
    ("tanh_hysteresis",),
)  # fmt: skip
SERIES: tuple[Names, ...] = (("series_compliance",), ("reversal_force_lag",), ("force_delay",))


def sided(values: Mapping[str, float], bias: float) -> Values:
    """A damper whose valves resist (1 + bias) times as much in rebound and (1 − bias) in compression."""
    out: Values = {}
    for side, k in (("r", 1.0 + bias), ("c", 1.0 - bias)):
        for name, power in (("bleed", -1.0), ("port", -0.5), ("shim_at", 1.0), ("shim", -1.0), ("blow_at", 1.0),
                            ("blow", -1.0)):  # fmt: skip
            if values.get(f"{name}_{side}", 0.0):
                out[f"{name}_{side}"] = values[f"{name}_{side}"] * k**power
    return out


def asymmetry(low: float = 1.3, high: float = 3.0) -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        ratio = rng.uniform(low, high)
        return sided(values, (ratio - 1.0) / (ratio + 1.0) * (1.0 if rng.random() < 0.8 else -1.0))

    return Effect(
        title="rebound and compression valves differ", names=(("damping_asymmetry",),), draw=draw,
        share=(low, high, "ratio of both sides"),
    )  # fmt: skip


def film_asymmetry() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        ratio = rng.uniform(1.2, 2.0)
        return {"film_bias": (ratio - 1.0) / (ratio + 1.0) * float(rng.choice([-1.0, 1.0]))}

    return Effect(
        title="viscous drag differs in both directions", names=(("damping_asymmetry",),), draw=draw,
        share=(1.2, 2.0, "ratio of both sides"),
    )  # fmt: skip


def gas(low: float = 0.06, high: float = 0.35) -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {
            "gas_force": rng.uniform(low, high) * scale.force_n,
            "gas_length": scale.stroke_m * np.exp(rng.uniform(np.log(1.8), np.log(8.0))),
            "gas_exponent": rng.uniform(1.1, 1.4),
            "gas_time": rng.uniform(0.5, 10.0),
        }

    names: tuple[Names, ...] = (
        ("gas_spring",), ("force_offset",), ("linear_stiffness",), ("force_offset", "linear_stiffness"),
    )  # fmt: skip
    return Effect(title="gas behind the rod", names=names, draw=draw, share=(low, high, "rms of the force"),
                  excludes=frozenset({"load cell not tared"}))  # fmt: skip


def friction(low: float = 0.03, high: float = 0.15) -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {
            "rub": rng.uniform(low, high) * scale.force_n,
            "rub_travel": scale.stroke_m * rng.uniform(0.00003, 0.0002),
            "rub_rise": rng.uniform(0.0, 0.12),
            "rub_speed": rng.uniform(0.02, 0.1) * scale.speed_m_s,
        }

    return Effect(title="seal friction", names=FRICTION, draw=draw, share=(low, high, "rms of the force"),
                  excludes=frozenset({"friction higher at rest"}))  # fmt: skip


def breakaway(low: float = 0.05, high: float = 0.15) -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {
            "rub": rng.uniform(low, high) * scale.force_n,
            "rub_travel": scale.stroke_m * rng.uniform(0.00003, 0.0001),
            "rub_rise": rng.uniform(0.5, 1.2),
            "rub_speed": rng.uniform(0.015, 0.06) * scale.speed_m_s,
        }

    names = (("stribeck_friction",), ("lugre_friction",), ("coulomb_friction",), ("presliding_friction",))
    return Effect(title="friction higher at rest", names=names, draw=draw, share=(low, high, "rms of the force"),
                  excludes=frozenset({"seal friction"}))  # fmt: skip


def rubber_friction(low: float, high: float) -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {
            "slip": rng.uniform(low, high) * scale.force_n,
            "slip_travel": rng.uniform(0.06, 0.3) * scale.stroke_m,
        }

    names = (("bouc_wen",), ("presliding_friction",), ("coulomb_friction",))
    return Effect(
        title="friction that begins as a spring", names=names, draw=draw, share=(low, high, "rms of the force")
    )


def digressive() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        knee, slope = rng.uniform(0.08, 0.4), rng.uniform(0.1, 0.45)
        return shims(values, knee * scale.speed_m_s, slope)

    return Effect(
        title="shims open: the slope falls", names=CURVES, draw=draw, share=(0.1, 0.45, "slope beyond the knee"),
        excludes=frozenset({"ports are turbulent: the slope rises"}),
    )  # fmt: skip


def shims(values: Mapping[str, float], knee_m_s: float, slope: float) -> Values:
    """Shim stacks on both sides that open at a speed; beyond, the slope is `slope` of that of the bleed."""
    out: Values = {"shim_round": 0.12}
    for side in "rc":
        bleed = values[f"bleed_{side}"]
        out[f"shim_at_{side}"] = values[f"area_{side}"] * knee_m_s / bleed
        out[f"shim_{side}"] = bleed * (1.0 / slope - 1.0)
    return out


def blow_off() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        share, slope = rng.uniform(0.45, 0.75), rng.uniform(0.05, 0.3)
        out: Values = {}
        for side in "rc":
            area = values[f"area_{side}"]
            out[f"blow_at_{side}"] = share * scale.peak_n / area
            out[f"blow_{side}"] = area**2 / (slope * scale.peak_n / scale.speed_m_s)
        return out

    names = (("relief_valve",), ("arctan_damping",), ("piecewise_linear_damping",), ("valve_damping",))
    return Effect(title="blow-off valve opens", names=names, draw=draw, share=(0.45, 0.75, "largest force"))


def progressive() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        share = rng.uniform(0.4, 2.0)
        out: Values = {}
        for side in "rc":
            q = values[f"area_{side}"] * scale.speed_m_s
            out[f"port_{side}"] = q / np.sqrt(share * q / values[f"bleed_{side}"])
        return out

    return Effect(
        title="ports are turbulent: the slope rises", names=(("quadratic_damping",),), draw=draw,
        share=(0.4, 2.0, "laminar pressure at full speed"), excludes=frozenset({"shims open: the slope falls"}),
    )  # fmt: skip


def bush(low: float = 0.015, high: float = 0.08) -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        k = scale.peak_n / (rng.uniform(low, high) * scale.stroke_m)
        return {"bush": k, "bush_loss": k * rng.uniform(0.0003, 0.002)}

    return Effect(title="rubber bush in series", names=SERIES, draw=draw, share=(low, high, "stroke"))


def oil_column(low: float = 0.015, high: float = 0.08) -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        k = scale.peak_n / (rng.uniform(low, high) * scale.stroke_m)
        return {"elastance": k / values["area_r"] ** 2}

    return Effect(title="oil column is soft", names=SERIES, draw=draw, share=(low, high, "stroke"),
                  excludes=frozenset({"free air in the oil"}))  # fmt: skip


def air(low: float = 0.02, high: float = 0.1) -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        travel, top = rng.uniform(low, high) * scale.stroke_m, scale.peak_n / values["area_r"]
        at = rng.uniform(0.04, 0.15) * top  # volume taken up by the air under high pressure: air·at/elastance
        stiff = 60.0 * top / (values["area_r"] * travel)
        return {"elastance": stiff, "air": travel * values["area_r"] * stiff / at, "air_at": at}

    names = (("aerated_oil",), ("reversal_force_lag",), ("series_compliance",), ("free_play",))
    return Effect(
        title="free air in the oil", names=names, sure=2, draw=draw, share=(low, high, "stroke"),
        excludes=frozenset({"oil column is soft", "rubber bush in series"}),
    )  # fmt: skip


def joint(low: float = 0.006, high: float = 0.04) -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        out = {"play": 2.0 * rng.uniform(low, high) * scale.stroke_m}
        return out if values.get("bush") else {**out, "bush": 400.0 * scale.peak_n / scale.stroke_m, "bush_loss": 0.0}

    names = (("free_play",), ("reversal_force_lag",))
    return Effect(
        title="joint with play", names=names, draw=draw, share=(low, high, "stroke"),
        excludes=frozenset({"free air in the oil", "rubber bush in series"}),
    )  # fmt: skip


def buffer() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        at = rng.uniform(0.55, 0.85)
        depth = (1.0 - at) * scale.stroke_m
        return {
            "buffer": rng.uniform(0.4, 1.5) * scale.force_n / (depth * 1.3),
            "buffer_at": at * scale.stroke_m,
            "buffer_length": depth / 0.3,
        }

    return Effect(
        title="rubber buffers at the ends", names=(("end_stop",), ("cubic_stiffness",)), draw=draw,
        share=(0.4, 1.5, "rms of the force, at the end"),
    )  # fmt: skip


def spring(low: float = 0.08, high: float = 0.4) -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {"spring": rng.uniform(low, high) * scale.force_n / (0.5 * scale.stroke_m)}

    return Effect(
        title="a spring beside it", names=(("linear_stiffness",), ("gas_spring",)), draw=draw,
        share=(low, high, "rms of the force, at half of the stroke"),
    )  # fmt: skip


def stiffening(low: float = 0.1, high: float = 0.6) -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        length = scale.stroke_m / rng.uniform(0.8, 1.6)
        r = scale.stroke_m / length
        return {
            "rise": rng.uniform(low, high) * scale.peak_n / (length * (np.sinh(r) - r)),
            "rise_length": length,
        }

    names = (("cubic_stiffness",), ("end_stop",))
    return Effect(title="stiffness that rises", names=names, draw=draw, share=(low, high, "largest force"))


def groove() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {"groove": rng.uniform(0.25, 1.0), "groove_length": scale.stroke_m}

    return Effect(
        title="bypass groove in the middle", names=(("position_dependent_damping",),), draw=draw,
        share=(0.25, 1.0, "damping"),
    )  # fmt: skip


def fade() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {"thin": rng.uniform(0.004, 0.016)}

    return Effect(
        title="oil thins as it warms", names=(("temperature_fade",),), draw=draw,
        share=(0.004, 0.016, "damping per kelvin"), needs_warmth=True,
    )  # fmt: skip


def fixture() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        hardest = scale.speed_m_s**2 / scale.stroke_m
        return {"mass": values.get("mass", 0.0) + rng.uniform(0.05, 0.25) * scale.force_n / hardest}

    return Effect(
        title="mass between load cell and machine", names=(("moving_mass",),), draw=draw,
        share=(0.05, 0.25, "rms of the force, at v²/x"),
    )  # fmt: skip


def coil_lag() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        rise = rng.uniform(0.015, 0.06)
        return {"coil_rise": rise, "coil_fall": rise * rng.uniform(0.35, 0.9)}

    return Effect(
        title="coil follows late, faster down than up", names=(("control_lag",), ("control_delay",)), draw=draw,
        share=(0.015, 0.06, "s"), needs_steps=True, excludes=frozenset({"driver waits"}),
    )  # fmt: skip


def driver_delay() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {"driver_delay": rng.uniform(0.012, 0.05)}

    return Effect(
        title="driver waits", names=(("control_delay",), ("control_lag",)), draw=draw, share=(0.012, 0.05, "s"),
        needs_steps=True, excludes=frozenset({"coil follows late, faster down than up"}),
    )  # fmt: skip


def saturation() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {"coil_sat": rng.uniform(0.6, 1.2) * scale.current_a}

    return Effect(
        title="iron saturates", names=(("control_saturation",),), draw=draw, share=(0.6, 1.2, "largest current")
    )


def remanence() -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {"coil_play": rng.uniform(0.06, 0.2) * scale.current_a}

    return Effect(
        title="iron stays magnetised", names=(("control_hysteresis",),), draw=draw,
        share=(0.06, 0.2, "largest current"), needs_steps=True,
    )  # fmt: skip
