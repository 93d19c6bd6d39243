"""The force of a damper at rest: gas force, its stiffness and dry friction, from its slowest tests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import floor, log10

import numpy as np
from numpy.typing import NDArray

from identification.smoothing import smooth_kinematics
from identification.steady import Cycles
from rigctl.runfile import Run

Floats = NDArray[np.float64]

_NEAR = 2.0  # times the slowest peak speed: these tests count. At 1 repeats alone; at 4 the valves count as friction
_AS_SLOW = 2.0  # times the lowest frequency of these: a short quick stroke adds stiffness, which grows with frequency
_REVERSAL = 0.2  # of the peak speed: below it a stroke still reverses (lag, presliding).
_APART = 1.3  # ratio of the peak speeds of slow tests from which they separate what bends with x from what bends with v
_ORDER = 2  # of the polynomial in speed that leads to rest; 1 takes a bend of the valves as friction
_POWERS, _MORE_POWERS = (1, 3), (1, 2, 3)  # of the displacement; more where speeds are apart
_OTHERS = ((1, 0.2, _MORE_POWERS), (2, 0.4, _POWERS), (1, 0.4, (1,)))  # other readings: their distance is part of the ±
_PLATEAU = 0.9  # of the speed of a triangle: its straight strokes without their corners
_OTHER_FREQUENCY = 1.3  # times the slowest test's: far enough apart to show what a stiffness gains with frequency
_LEAST_SAMPLES = 6  # of a stroke: a reading of a cycle has seven unknowns


@dataclass(frozen=True, slots=True)
class Estimate:
    """A value and its standard deviation."""

    value: float
    std: float

    def __str__(self) -> str:
        if not 0.0 < self.std < np.inf:
            return f"{self.value:.4g}"
        digits = max(0, 1 - floor(log10(self.std)))  # two of the deviation
        return f"{self.value:.{digits}f} ± {self.std:.{digits}f}"


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticForce:
    """F = force + stiffness·x ± friction at rest, x from mid stroke; + in rebound, − in compression.

    A standard deviation holds what repeats differently from cycle to cycle, and what the way to speed zero leaves open.
    """

    force: Estimate  # N, in tension: gas that pushes the rod out is negative, an untared load cell is part of it
    stiffness: Estimate  # N/m
    friction: Estimate  # N: with it all that saturates below the slowest speed
    slowest_m_s: float
    fastest_m_s: float
    tests: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Strokes:
    """Samples of slow strokes of one test, (N,) each; `x` from mid stroke; `cycle` numbers whole cycles."""

    name: str
    frequency_hz: float
    x: Floats
    v: Floats
    force: Floats
    cycle: NDArray[np.int64]
    current: float | None
    constant_speed: bool = False

    @property
    def speed_m_s(self) -> float:
        """The peak speed, m/s."""
        return float(np.max(np.abs(self.v)))


def strokes_of_sine(test: Cycles) -> Strokes:
    """The strokes of a steady sine."""
    x, v = test.motion(test.t)
    cycle = (test.t * test.frequency_hz + 1e-9).astype(np.int64)
    return Strokes(
        name=test.name, frequency_hz=test.frequency_hz, x=x - float(test.x_lines[0].real), v=v, force=test.force,
        cycle=cycle, current=test.current,
    )  # fmt: skip


def strokes_of_triangle(run: Run) -> Strokes | None:
    """The straight strokes of a triangle test; None where it has no whole cycle or no force."""
    x, name = run.channels["displacement"], run.path.name if run.path is not None else run.run_id
    force = run.channels.get("force")
    middle, reach = (x.max() + x.min()) / 2, (x.max() - x.min()) / 2
    v = smooth_kinematics(x, run.sample_rate_hz).v
    speed = float(np.quantile(np.abs(v), 0.6))
    turns = np.flatnonzero(np.diff(np.sign(np.where(np.abs(v) > 0.5 * speed, v, 0.0))))
    if force is None or reach == 0.0 or turns.size < 2 or np.ptp(force) == 0.0:
        return None
    cycle = np.floor(np.cumsum(np.abs(v)) / run.sample_rate_hz / (4 * reach)).astype(np.int64)
    keep = (np.abs(v) > _PLATEAU * speed) & (np.abs(x - middle) < _PLATEAU * reach)
    current = run.channels.get("current")
    return Strokes(
        name=name, frequency_hz=speed / (4 * reach), x=(x - middle)[keep], v=speed * np.sign(v[keep]),
        force=force[keep], cycle=cycle[keep], current=None if current is None else float(np.mean(current[keep])),
        constant_speed=True,
    )  # fmt: skip


def static_force(tests: Sequence[Strokes]) -> StaticForce:
    """What the slowest of these tests, all at one current, say of rest; triangles alone where there are any.

    F = F_0 + k x + c_2 x² + c_3 x³ ± F_c + p(v), least squares over all strokes, with a polynomial p(v) of its own for
    each direction: the two branches of a loop lead to F_0 ± F_c at v = 0, and what is odd in the displacement along
    both is k. At one speed of a sine x² and v² are the same, so c_2 is left out there.
    """
    chosen = [one for one in tests if one.constant_speed] or list(tests)
    slowest = min(one.speed_m_s for one in chosen)
    slow = [one for one in chosen if one.speed_m_s <= _NEAR * slowest or one.constant_speed]
    lowest = min(one.frequency_hz for one in slow)
    slow = [one for one in slow if one.frequency_hz <= _AS_SLOW * lowest or one.constant_speed]
    order, powers = _ORDER, _MORE_POWERS if max(one.speed_m_s for one in slow) > _APART * slowest else _POWERS
    if slow[0].constant_speed:  # one speed leads nowhere, two lead straight
        speeds = np.sort([one.speed_m_s for one in slow])
        order, powers = min(_ORDER, int(np.sum(np.diff(speeds) > 0.2 * speeds[1:]))), _MORE_POWERS
    found = _solved(slow, order, _REVERSAL, powers)
    others = [_solved(slow, min(other, order), share, other_powers) for other, share, other_powers in _OTHERS]
    spread = np.max(np.abs(np.array(others) - found), axis=0)
    spread[1] = np.hypot(spread[1], _gain_of_stiffness(slow, tests, found[1]))
    std = np.hypot(spread, _repeatability(slow, order))
    force, stiffness, friction = (Estimate(float(v), float(s)) for v, s in zip(found, std, strict=True))
    return StaticForce(
        force=force, stiffness=stiffness, friction=friction, slowest_m_s=min(one.speed_m_s for one in slow),
        fastest_m_s=max(one.speed_m_s for one in slow), tests=tuple(one.name for one in slow),
    )  # fmt: skip


def _solved(slow: Sequence[Strokes], order: int, reversal: float, powers: Sequence[int]) -> Floats:
    """F_0, k and F_c, (3,)."""
    kept = [(one, np.abs(one.v) > reversal * one.speed_m_s) for one in slow]
    x, v, force = (
        np.concatenate([np.asarray(getattr(one, name))[keep] for one, keep in kept]) for name in ("x", "v", "force")
    )
    side, speed, reach = np.sign(v), np.abs(v) / np.abs(v).max(), np.abs(x).max()
    columns = [np.ones_like(x), side, *((x / reach) ** n for n in powers)]
    for n in range(1, order + 1):
        columns += [speed**n * (side > 0), -(speed**n) * (side < 0)]
    found = np.linalg.lstsq(np.stack(columns, axis=1), force, rcond=None)[0]
    return np.array([found[0], found[2] / reach, found[1]])


def _repeatability(slow: Sequence[Strokes], order: int) -> Floats:
    """Standard deviation of the mean over cycles, (3,), with Student's factor for few; nothing where there is one."""
    from scipy.special import stdtrit  # 0.2 s to import: only where there are sines or triangles

    order = order if not slow[0].constant_speed else 0  # a cycle of a triangle has one speed
    cycles = [part for one in slow for part in _cycles(one)]
    if len(cycles) < 2:
        return np.zeros(3)
    each = np.array(
        [_solved([cycle], order, _REVERSAL, _MORE_POWERS if slow[0].constant_speed else _POWERS) for cycle in cycles]
    )
    if slow[0].constant_speed:  # speeds differ: what repeats is seen within a test alone
        each -= np.array([each[[c.name == d.name for d in cycles]].mean(axis=0) for c in cycles])
    factor = float(stdtrit(len(cycles) - 1, 0.8413))
    return np.asarray(factor * each.std(axis=0, ddof=1) / np.sqrt(len(cycles)))


def _cycles(one: Strokes) -> list[Strokes]:
    """The cycles of a test that have strokes in both directions."""
    each = [one.cycle == number for number in np.unique(one.cycle)]
    return [
        replace(one, x=one.x[keep], v=one.v[keep], force=one.force[keep], cycle=one.cycle[keep])
        for keep in each
        if min(np.sum(one.v[keep] > 0), np.sum(one.v[keep] < 0)) >= _LEAST_SAMPLES
    ]


def _gain_of_stiffness(slow: Sequence[Strokes], tests: Sequence[Strokes], k: float) -> float:
    """What the stiffness may have gained from rest to these tests, N/m: k grows with ω² where a force lags."""
    at = max(one.frequency_hz for one in slow)
    faster = [one for one in tests if one.frequency_hz > _OTHER_FREQUENCY * at and not one.constant_speed]
    if not faster:
        return 0.0
    following = min(faster, key=lambda one: one.frequency_hz)
    gained = float(_solved([following], _ORDER, _REVERSAL, _POWERS)[1]) - k
    return abs(gained) / ((following.frequency_hz / at) ** 2 - 1.0)
