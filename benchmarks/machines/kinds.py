"""Kinds of machine: what each is built of, how it is tested, the model that is given, and what that model may lack."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.machines import channels, outside
from benchmarks.machines import effects as lack
from benchmarks.machines.bases import Base, BaseElement
from benchmarks.machines.effect import Effect, Rng, Scale, Values, usual
from benchmarks.machines.motions import Envelope


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """One machine without hidden effects, its given model, and the effects that it can have."""

    kind: str
    values: Values
    envelope: Envelope
    base: Base
    effects: tuple[Effect, ...]
    outside: tuple[Effect, ...]
    always: tuple[Effect, ...] = ()  # what this base lacks on any machine of the kind


def _element(path: str, element: str, held: tuple[str, ...] = (), **values: float) -> BaseElement:
    return BaseElement(path=path, element=element, values=values, held=frozenset(held))


def _viscous(c: float, c_control: float = 0.0) -> BaseElement:
    held = () if c_control else ("c_control",)
    return _element("core", "viscous_damping", held, c=c, c_control=c_control)


def _arctan(force: float, speed: float) -> BaseElement:
    return _element("core", "arctan_damping", ("F2",), F1=0.6 * force, S=8.0 / speed, d=0.3 * force / speed, F2=0.0)


def _oil(rng: Rng, c: float, area: float) -> Values:
    """A piston with equal laminar gaps on both sides, c in N·s/m."""
    bleed = area**2 / c
    return {"area_r": area, "area_c": area, "bleed_r": bleed, "bleed_c": bleed}


def mono_tube(rng: Rng) -> Machine:
    """Piston with shims, gas behind a floating piston."""
    speed, force = rng.uniform(0.3, 1.2), rng.uniform(500.0, 2500.0)
    envelope = Envelope(
        stroke_m=rng.uniform(0.018, 0.05), speed_m_s=speed, low_hz=rng.uniform(0.3, 0.8), high_hz=rng.uniform(5.0, 14.0)
    )
    values = _oil(rng, force / speed, rng.uniform(0.6e-3, 1.4e-3))
    curved = rng.random() < 0.5
    if curved:
        values |= lack.shims(values, rng.uniform(0.1, 0.3) * speed, rng.uniform(0.15, 0.4))
    base = (_arctan(0.4 * force, speed),) if curved else (_viscous(force / speed),)
    own = (lack.blow_off(),) if curved else (lack.digressive(), lack.progressive(), lack.blow_off())
    return Machine(
        kind="mono_tube", values=values, envelope=envelope, base=base,
        effects=(usual(lack.gas()), lack.friction(), lack.asymmetry(), lack.bush(), lack.air(), lack.oil_column(),
                 lack.buffer(), lack.groove(),
                 lack.fade(), *own, *channels.CHAIN),
        outside=(outside.CAVITATION, outside.HEAT, *outside.CHAIN),
    )  # fmt: skip


def twin_tube(rng: Rng) -> Machine:
    """Rebound valve in the piston, compression valve at the foot, a little gas, air that gets into the oil."""
    speed, force = rng.uniform(0.3, 1.0), rng.uniform(400.0, 2000.0)
    envelope = Envelope(
        stroke_m=rng.uniform(0.02, 0.06), speed_m_s=speed, low_hz=rng.uniform(0.3, 0.8), high_hz=rng.uniform(4.0, 12.0)
    )
    piston, rod = rng.uniform(0.5e-3, 0.9e-3), rng.uniform(0.1e-3, 0.2e-3)
    c = force / speed
    values: Values = {"area_r": piston, "area_c": rod, "bleed_r": piston**2 / c, "bleed_c": rod**2 / c}
    curved = rng.random() < 0.5
    if curved:
        values |= lack.shims(values, rng.uniform(0.1, 0.3) * speed, rng.uniform(0.15, 0.4))
    base = (_arctan(0.4 * force, speed),) if curved else (_viscous(c),)
    own = () if curved else (lack.digressive(), lack.progressive())
    return Machine(
        kind="twin_tube", values=values, envelope=envelope, base=base,
        effects=(lack.gas(0.03, 0.12), lack.friction(), usual(lack.asymmetry(1.5, 3.5)), lack.air(0.03, 0.12),
                 lack.bush(),
                 lack.buffer(), lack.fade(), *own, *channels.CHAIN),
        outside=(outside.HEAT, *outside.CHAIN),
    )  # fmt: skip


def magnetic(rng: Rng) -> Machine:
    """Magneto-rheological gap with a coil."""
    speed, force, top = rng.uniform(0.1, 0.6), rng.uniform(300.0, 2000.0), rng.uniform(0.8, 3.0)
    envelope = Envelope(
        stroke_m=rng.uniform(0.01, 0.03), speed_m_s=speed, low_hz=rng.uniform(0.3, 0.8), high_hz=rng.uniform(3.0, 10.0),
        current_a=(rng.uniform(0.0, 0.2) * top, top),
    )  # fmt: skip
    effects = [lack.gas(), lack.friction(), lack.bush(), lack.joint(), usual(lack.coil_lag()), lack.driver_delay(),
                 usual(lack.saturation()), lack.remanence(), lack.fade(), *channels.CHAIN]  # fmt: skip
    if rng.random() < 0.35:
        soft, firm = 0.2 * force / speed, 0.8 * force / speed / top
        values: Values = {"film": soft}
        base: Base = (_viscous(soft, firm),)
        # A gain on the current, and a machine that yields: what the model lacks is always the yield.
        return Machine(kind="magnetic", values=values, envelope=envelope, base=base,
                       effects=tuple(effects), outside=(outside.KICK, outside.HEAT, *outside.CHAIN),
                 always=(_yield(force, top),))  # fmt: skip
    values = {
        "film": 0.25 * force / speed,
        "yield_0": rng.uniform(0.05, 0.15) * force,
        "yield_i": 0.8 * force / top,
        "yield_speed": rng.uniform(0.02, 0.08) * speed,
    }
    base = (
        _element("core", "tanh_hysteresis", ("delta",), alpha=0.1 * force, alpha_control=0.8 * force / top,
                 beta=1.0 / values["yield_speed"], delta=0.0),
        _viscous(values["film"]),
    )  # fmt: skip
    return Machine(
        kind="magnetic",
        values=values,
        envelope=envelope,
        base=base,
        effects=tuple(effects),
        outside=(outside.KICK, outside.HEAT, *outside.CHAIN),
    )


def _yield(force: float, top: float) -> Effect:
    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        return {
            "yield_0": rng.uniform(0.05, 0.15) * force,
            "yield_i": 0.8 * force / top,
            "yield_speed": rng.uniform(0.02, 0.08) * scale.speed_m_s,
        }

    names = (("tanh_hysteresis",), ("arctan_damping",), ("relief_valve",), ("valve_damping",), ("coulomb_friction",))
    return Effect(title="the fluid yields", names=names, draw=draw, share=(0.8, 0.95, "largest force"))


def controlled(rng: Rng) -> Machine:
    """Damper with a spool that a current closes."""
    speed, force, top = rng.uniform(0.3, 1.0), rng.uniform(800.0, 4000.0), rng.uniform(1.0, 2.0)
    envelope = Envelope(
        stroke_m=rng.uniform(0.02, 0.05), speed_m_s=speed, low_hz=rng.uniform(0.3, 0.8), high_hz=rng.uniform(4.0, 12.0),
        current_a=(0.2 * top, top),
    )  # fmt: skip
    firm = rng.uniform(1.5, 4.0)
    soft = force / speed / (1.0 + firm)
    values = _oil(rng, soft, rng.uniform(0.6e-3, 1.4e-3))
    values |= {"firm": firm, "firm_at": 0.6 * top, "firm_width": 0.8 * top}
    base: Base = (_viscous(0.4 * soft, 0.8 * soft * firm / top),)
    return Machine(
        kind="controlled", values=values, envelope=envelope, base=base,
        effects=(lack.gas(), lack.friction(), lack.asymmetry(), lack.digressive(), lack.bush(),
                 usual(lack.coil_lag()), lack.driver_delay(),
                 lack.remanence(), lack.saturation(), lack.air(), *channels.CHAIN),
        outside=(outside.KICK, outside.HEAT, *outside.CHAIN),
    )  # fmt: skip


def yaw(rng: Rng) -> Machine:
    """Yaw damper of a rail vehicle: short stroke, high force, rubber joints at both ends."""
    speed, force = rng.uniform(0.06, 0.25), rng.uniform(4000.0, 14000.0)
    envelope = Envelope(
        stroke_m=rng.uniform(0.004, 0.02), speed_m_s=speed, low_hz=rng.uniform(0.4, 1.0), high_hz=rng.uniform(3.0, 10.0)
    )
    values = _oil(rng, 2.0 * force / speed, rng.uniform(1.5e-3, 3.0e-3))
    curved = rng.random() < 0.6
    if curved:
        values |= lack.shims(values, rng.uniform(0.1, 0.3) * speed, rng.uniform(0.1, 0.35))
    base = (_arctan(force, speed),) if curved else (_viscous(2.0 * force / speed),)
    own = () if curved else (lack.digressive(), lack.blow_off())
    return Machine(
        kind="yaw", values=values, envelope=envelope, base=base,
        effects=(usual(lack.bush(0.02, 0.12)), lack.joint(), lack.air(), lack.friction(0.02, 0.06),
                 lack.asymmetry(1.1, 1.5),
                 lack.fade(), *own, *channels.CHAIN),
        outside=(outside.HEAT, *outside.CHAIN),
    )  # fmt: skip


def bush(rng: Rng) -> Machine:
    """Elastomer mount: stiffness, loss, friction of its filler."""
    stroke, force, fast = rng.uniform(0.001, 0.006), rng.uniform(400.0, 4000.0), rng.uniform(5.0, 18.0)
    envelope = Envelope(
        stroke_m=stroke, speed_m_s=2.0 * np.pi * 0.35 * fast * stroke, low_hz=rng.uniform(0.3, 1.0), high_hz=fast
    )
    k = force / stroke
    values = {"spring": k, "film": rng.uniform(0.05, 0.2) * k / (2.0 * np.pi * 0.5 * fast)}
    base: Base = (_element("core", "linear_stiffness", k=k), _viscous(values["film"]))
    return Machine(
        kind="bush", values=values, envelope=envelope, base=base,
        effects=(usual(lack.rubber_friction(0.05, 0.25)), lack.friction(0.02, 0.08), usual(lack.stiffening()),
                 lack.film_asymmetry(), lack.buffer(), *channels.CHAIN),
        outside=(outside.POWER_LAW, *outside.CHAIN),
    )  # fmt: skip


def air_spring(rng: Rng) -> Machine:
    """Rolling-lobe air spring: gas, and the friction of its bellows."""
    stroke, force, fast = rng.uniform(0.02, 0.06), rng.uniform(1000.0, 8000.0), rng.uniform(2.0, 6.0)
    envelope = Envelope(
        stroke_m=stroke, speed_m_s=2.0 * np.pi * 0.4 * fast * stroke, low_hz=rng.uniform(0.2, 0.5), high_hz=fast
    )
    k = force / stroke * 0.5
    values = {"spring": k, "film": 0.06 * k / (2.0 * np.pi * 0.5 * fast)}
    base: Base = (
        _element("core", "linear_stiffness", k=k),
        _viscous(values["film"]),
        _element("sensor", "force_offset", F0=0.2 * force),
    )

    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        length = scale.stroke_m * rng.uniform(2.0, 5.0)
        return {"spring": 0.0, "gas_force": k * length / 1.3, "gas_length": length, "gas_exponent": 1.38,
                "gas_time": rng.uniform(2.0, 20.0)}  # fmt: skip

    names = (("gas_spring",), ("cubic_stiffness",))
    gas = Effect(title="the air is a gas", names=names, draw=draw, share=(2.0, 5.0, "stroke"))
    return Machine(
        kind="air_spring", values=values, envelope=envelope, base=base,
        effects=(usual(gas), lack.rubber_friction(0.04, 0.15), lack.friction(0.03, 0.1), lack.buffer(),
                 channels.low_pass(), channels.late(), channels.drift()),
        outside=(outside.POWER_LAW, *outside.CHAIN),
    )  # fmt: skip


def slide(rng: Rng) -> Machine:
    """Linear axis: the force of its motor moves a carriage on rails."""
    speed, stroke, fast = rng.uniform(0.15, 0.8), rng.uniform(0.03, 0.2), rng.uniform(2.0, 6.0)
    envelope = Envelope(stroke_m=stroke, speed_m_s=speed, low_hz=rng.uniform(0.2, 0.5), high_hz=fast)
    mass = rng.uniform(4.0, 40.0)
    film = rng.uniform(0.3, 1.0) * mass * speed / stroke + rng.uniform(10.0, 80.0)
    values = {"mass": mass, "film": film}
    base: Base = (_element("sensor", "moving_mass", m=mass), _viscous(film))
    return Machine(
        kind="slide", values=values, envelope=envelope, base=base,
        effects=(usual(lack.friction(0.1, 0.6)), lack.breakaway(0.1, 0.5), lack.film_asymmetry(), lack.spring(),
                 channels.zero(),
                 channels.late(), channels.drift(), lack.buffer()),
        outside=(outside.COG, *outside.CHAIN),
    )  # fmt: skip


def pneumatic_cylinder(rng: Rng) -> Machine:
    """Air through throttles at both ends, seals that stick."""
    speed, force = rng.uniform(0.1, 0.5), rng.uniform(50.0, 500.0)
    envelope = Envelope(
        stroke_m=rng.uniform(0.02, 0.08), speed_m_s=speed, low_hz=rng.uniform(0.2, 0.6), high_hz=rng.uniform(2.0, 8.0)
    )
    values = _oil(rng, force / speed, rng.uniform(0.4e-3, 2.0e-3))

    def draw(rng: Rng, scale: Scale, values: Mapping[str, float]) -> Values:
        k = scale.peak_n / (rng.uniform(0.03, 0.15) * scale.stroke_m)
        return {"elastance": k / values["area_r"] ** 2, "dead_length": scale.stroke_m * rng.uniform(2.5, 6.0)}

    air = Effect(title="air column is soft", names=lack.SERIES, draw=draw, share=(0.03, 0.15, "stroke"))
    return Machine(
        kind="pneumatic_cylinder", values=values, envelope=envelope, base=(_viscous(force / speed),),
        effects=(usual(air), lack.friction(0.05, 0.25), lack.breakaway(0.05, 0.25), lack.asymmetry(1.2, 2.0),
                 lack.gas(), lack.progressive(),
                 lack.buffer(), *channels.CHAIN),
        outside=(outside.HEAT, *outside.CHAIN),
    )  # fmt: skip


def hydraulic_cylinder(rng: Rng) -> Machine:
    """Oil through a throttle, heavy seals, a check valve."""
    speed, force = rng.uniform(0.05, 0.4), rng.uniform(1000.0, 20000.0)
    envelope = Envelope(
        stroke_m=rng.uniform(0.01, 0.08), speed_m_s=speed, low_hz=rng.uniform(0.2, 0.6), high_hz=rng.uniform(2.0, 8.0)
    )
    values = _oil(rng, force / speed, rng.uniform(1.0e-3, 4.0e-3))
    return Machine(
        kind="hydraulic_cylinder", values=values, envelope=envelope, base=(_viscous(force / speed),),
        effects=(usual(lack.progressive()), lack.breakaway(), lack.friction(), lack.oil_column(),
                 lack.asymmetry(1.3, 4.0),
                 lack.fixture(), lack.blow_off(), lack.fade(), *channels.CHAIN),
        outside=(outside.HEAT, *outside.CHAIN),
    )  # fmt: skip


def oscillator(rng: Rng) -> Machine:
    """A mass on a spring, driven by a known force: only its motion is measured beside it."""
    mass, resonance, damping = rng.uniform(0.5, 5.0), rng.uniform(2.0, 8.0), rng.uniform(0.05, 0.2)
    k = mass * (2.0 * np.pi * resonance) ** 2
    stroke = rng.uniform(0.002, 0.02)
    force = k * stroke * rng.uniform(0.3, 0.6)
    envelope = Envelope(
        stroke_m=force, speed_m_s=force * 2.0 * np.pi * resonance * 2.0, low_hz=0.25 * resonance,
        high_hz=2.0 * resonance, driven=True,
    )  # fmt: skip
    values = {"mass": mass, "spring": k, "film": 2.0 * damping * np.sqrt(k * mass)}
    base: Base = (
        _element("sensor", "moving_mass", m=mass),
        _element("core", "linear_stiffness", k=k),
        _viscous(values["film"]),
    )
    return Machine(
        kind="oscillator", values=values, envelope=envelope, base=base,
        effects=(usual(lack.stiffening(0.2, 0.8)), lack.friction(0.03, 0.12), lack.breakaway(0.03, 0.1),
                 lack.buffer(),
                 lack.film_asymmetry(), channels.zero(), channels.late()),
        outside=(outside.POWER_LAW, *outside.CHAIN),
    )  # fmt: skip


def rack(rng: Rng) -> Machine:
    """Steering rack: inertia of pinion and rack, friction of the yoke, play of the teeth."""
    speed, stroke, fast = rng.uniform(0.1, 0.4), rng.uniform(0.02, 0.07), rng.uniform(2.0, 5.0)
    envelope = Envelope(stroke_m=stroke, speed_m_s=speed, low_hz=rng.uniform(0.2, 0.5), high_hz=fast)
    mass = rng.uniform(4.0, 15.0)
    film = rng.uniform(200.0, 1200.0)
    values = {"mass": mass, "film": film}
    base: Base = (_element("sensor", "moving_mass", m=mass), _viscous(film))
    return Machine(
        kind="rack", values=values, envelope=envelope, base=base,
        effects=(usual(lack.friction(0.1, 0.5)), lack.breakaway(0.1, 0.4), lack.joint(), lack.bush(),
                 lack.spring(0.1, 0.5),
                 lack.stiffening(), lack.groove(), *channels.CHAIN),
        outside=(outside.COG, *outside.CHAIN),
    )  # fmt: skip


KINDS: Mapping[str, Callable[[Rng], Machine]] = {
    "mono_tube": mono_tube,
    "twin_tube": twin_tube,
    "magnetic": magnetic,
    "controlled": controlled,
    "yaw": yaw,
    "bush": bush,
    "air_spring": air_spring,
    "slide": slide,
    "pneumatic_cylinder": pneumatic_cylinder,
    "hydraulic_cylinder": hydraulic_cylinder,
    "oscillator": oscillator,
    "rack": rack,
}
