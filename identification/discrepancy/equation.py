"""An effect without a name as an equation: few terms of motion, current, temperature and memory, found by pursuit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identification.compiled import compiled
from identification.criteria import CHANCE, FORM, TEXT
from identification.discrepancy.signatures import Tangent
from identification.record import Record

Floats = NDArray[np.float64]

_SPANS = 24  # lengths tried for a force that repeats along the stroke
_TIMES = (0.3, 1.0, 3.0, 10.0, 30.0)  # of the time of a motion: how long a memory may last
_BINS = 40


@dataclass(frozen=True, slots=True, kw_only=True)
class Equation:
    """What a repeatable remainder is like: `share` of it is explained on runs that the coefficients have not seen.

    `terms` are pairs of text and coefficient, N; their variables are in units of their own rms, which the text holds.
    """

    terms: tuple[tuple[str, float], ...]
    share: float
    parity: str

    @property
    def text(self) -> str:
        """One line: the equation, or why there is none, and the parity."""
        if not self.terms:
            return f"no short equation of motion, current, temperature and their memory describes it; {self.parity}"
        sum_ = " ".join(f"{'−' if c < 0 else '+'} {abs(c):.3g} N·{name}" for name, c in self.terms).removeprefix("+ ")
        return f"as an equation Δf ≈ {sum_}, {100 * min(self.share, 1.0):.0f} % of it on runs left out; {self.parity}"


def describe(records: Sequence[Record], at: Tangent) -> Equation:
    """The shortest equation for what a fitted model leaves, beside what a refit of it could absorb.

    Orthogonal matching pursuit over a library of dimensionless terms, in the whitened space in which the model was
    fitted; a term is kept while it pays on records that its coefficient was not fitted to.
    """
    names, columns = _stacked(records, at)
    edges = np.cumsum([0] + [r.measured.size for r in records])
    chosen: list[str] = []
    share = 0.0
    while len(chosen) < TEXT.most_terms:
        best = _next(names, columns, at.residual, chosen)
        if best is None:
            break
        grown = _left_out(_matrix(columns, [*chosen, best]), at.residual, edges)
        if grown < share + TEXT.term_pays:
            break
        chosen, share = [*chosen, best], grown
    parity = _parity(records, at)
    if share < TEXT.equation_worth:
        return Equation(terms=(), share=max(share, 0.0), parity=parity)
    weights = np.linalg.lstsq(_matrix(columns, chosen), at.residual, rcond=None)[0]
    labels = [label for name in chosen for label in names[name]]
    return Equation(terms=tuple(zip(labels, map(float, weights), strict=True)), share=share, parity=parity)


def _stacked(records: Sequence[Record], at: Tangent) -> tuple[dict[str, tuple[str, ...]], dict[str, Floats]]:
    """Labels and projected whitened columns (M, 1 or 2) of every term that is not absorbed by the model.

    Terms of a current or a temperature are there where every record has it.
    """
    scales = _scales(records)
    each = [_library(r, scales) for r in records]
    labels, columns = {}, {}
    for name, (label, _) in each[0].items():
        if any(name not in part for part in each):
            continue
        whole = np.concatenate(
            [w * part[name][1][r.window] for part, w, r in zip(each, at.weights, records, strict=True)]
        )
        own = at.project(whole)
        if np.linalg.norm(own) > TEXT.term_own * max(float(np.linalg.norm(whole)), 1e-300):
            labels[name], columns[name] = label, own
    return labels, columns


@dataclass(frozen=True, slots=True)
class _Scales:
    x: float
    v: float
    a: float
    i: float
    warmth: float
    centre: float
    current: float
    temperature: float
    stroke: float

    @property
    def time(self) -> float:
        return self.v / self.a


def _scales(records: Sequence[Record]) -> _Scales:
    def joined(name: str) -> Floats:
        return np.concatenate([getattr(r.motion, name)[r.window] for r in records])

    x, v, a, i, warm = (joined(name) for name in ("x", "v", "a", "i", "temperature"))
    tiny = 1e-300
    return _Scales(
        x=max(float(np.std(x)), tiny), v=max(float(np.sqrt(np.mean(v**2))), tiny),
        a=max(float(np.sqrt(np.mean(a**2))), tiny), i=max(float(np.std(i)), tiny),
        warmth=max(float(np.std(warm)), tiny), centre=float(np.mean(x)), current=float(np.mean(i)),
        temperature=float(np.mean(warm)), stroke=float(np.ptp(x)),
    )  # fmt: skip


def _library(r: Record, s: _Scales) -> Mapping[str, tuple[tuple[str, ...], Floats]]:
    """Name → labels and columns (N, 1 or 2) over the whole record, dimensionless."""
    m = r.motion
    x, v, a = (m.x - s.centre) / s.x, m.v / s.v, m.a / s.a
    sign = np.tanh(20.0 * v)
    ξ, ν, α = f"(x/{_si(s.x, 'm')})", f"(v/{_si(s.v, 'm/s')})", f"(a/{_si(s.a, 'm/s²')})"
    plain = {
        "sgn v": sign, f"{ν}": v, f"{ν}²": v * v, f"|{ν}|": np.abs(v), f"{ν}·|{ν}|": v * np.abs(v), f"{ν}³": v**3,
        f"{ξ}": x, f"{ξ}²": x * x, f"{ξ}³": x**3, f"|{ξ}|": np.abs(x), f"{α}": a, f"{α}·|{α}|": a * np.abs(a),
        f"{ξ}·{ν}": x * v, f"{ξ}²·{ν}": x * x * v, f"|{ξ}|·{ν}": np.abs(x) * v, f"{ξ}·|{ν}|": x * np.abs(v),
        f"|{ξ}|·sgn v": np.abs(x) * sign, f"{ξ}·sgn v": x * sign, f"{ξ}²·sgn v": x * x * sign,
        f"{α} where v > 0": a * (v > 0.0), f"{α} where v < 0": a * (v < 0.0),
        f"{ν} where x > 0": v * (x > 0.0), f"{ξ}·{α}": x * a, f"{ν}·{α}": v * a,
    }  # fmt: skip
    plain |= _current(r, s, v, sign) | _warmth(r, s, v, sign) | _memory(r, s, v, sign, ν)
    out: dict[str, tuple[tuple[str, ...], Floats]] = {name: ((name,), c[:, None]) for name, c in plain.items()}
    for length in np.geomspace(s.stroke / 40.0, s.stroke / 1.5, _SPANS):
        turn, text = 2.0 * np.pi * m.x / length, f"2π·x/{_si(float(length), 'm')}"
        out[f"along the stroke {text}"] = (
            (f"sin({text})", f"cos({text})"),
            np.column_stack([np.sin(turn), np.cos(turn)]),
        )
    return out


def _current(r: Record, s: _Scales, v: Floats, sign: Floats) -> dict[str, Floats]:
    if not r.has_current:
        return {}
    i, κ = (r.motion.i - s.current) / s.i, f"((i − {s.current:.3g} A)/{_si(s.i, 'A')})"
    rate = np.gradient(i) / r.dt * s.time
    ν = f"(v/{_si(s.v, 'm/s')})"
    return {κ: i, f"{κ}²": i * i, f"{κ}·{ν}": i * v, f"{κ}²·{ν}": i * i * v, f"{κ}·sgn v": i * sign,
            f"{κ}²·sgn v": i * i * sign, f"(di/dt · {_si(s.time / s.i, 's/A')})": rate,
            f"{ν}·(di/dt · {_si(s.time / s.i, 's/A')})": rate * v}  # fmt: skip


def _warmth(r: Record, s: _Scales, v: Floats, sign: Floats) -> dict[str, Floats]:
    if not r.has_temperature:
        return {}
    warm, θ = (r.motion.temperature - s.temperature) / s.warmth, f"((T − {s.temperature:.3g} °C)/{s.warmth:.2g} K)"
    ν = f"(v/{_si(s.v, 'm/s')})"
    return {θ: warm, f"{θ}·{ν}": warm * v, f"{θ}²·{ν}": warm * warm * v, f"{θ}·sgn v": warm * sign}


def _memory(r: Record, s: _Scales, v: Floats, sign: Floats, ν: str) -> dict[str, Floats]:
    """What the motion was: the velocity through a lag, and the velocity times how fast it lately was."""
    out = {}
    for part in _TIMES:
        tau = part * s.time
        late, loud = _lag(v, r.dt, tau), _lag(v * v, r.dt, tau)
        text = _si(tau, "s")
        out[f"{ν} after a lag of {text}"] = late
        out[f"{ν}·mean of {ν}² over {text}"] = loud * v
        out[f"sgn v·mean of {ν}² over {text}"] = loud * sign
    return out


def _lag(u: Floats, dt: float, tau: float) -> Floats:
    y = np.empty_like(u)
    _lagged(u, float(np.exp(-dt / tau)), y)
    return y


@compiled
def _lagged(u: Floats, q: float, y: Floats) -> None:
    """y_k = q·y_(k−1) + (1 − q)·u_k from rest at u_0, into y: compiled, for the import of scipy.signal takes 0.5 s."""
    last = u[0]
    for k in range(u.size):
        last = q * last + (1.0 - q) * u[k]
        y[k] = last


def _matrix(columns: Mapping[str, Floats], chosen: Sequence[str]) -> Floats:
    return np.column_stack([columns[name] for name in chosen])


def _next(names: Mapping[str, tuple[str, ...]], columns: Mapping[str, Floats], rest: Floats,
          chosen: Sequence[str]) -> str | None:  # fmt: skip
    """The term that takes most of what those chosen leave."""
    q = np.linalg.qr(_matrix(columns, chosen))[0] if chosen else np.zeros((rest.size, 0))
    left = rest - q @ (q.T @ rest)
    best, most = None, 0.0
    for name in names:
        if name in chosen:
            continue
        own = columns[name] - q @ (q.T @ columns[name])
        if np.min(np.linalg.norm(own, axis=0)) < TEXT.term_new * np.max(np.linalg.norm(columns[name], axis=0)):
            continue  # little of it is new
        basis = np.linalg.qr(own)[0]
        took = float(np.sum((basis.T @ left) ** 2))
        if took > most:
            best, most = name, took
    return best


def _left_out(matrix: Floats, rest: Floats, edges: NDArray[np.int64]) -> float:
    """Share of the remainder beyond the noise, explained in every record by coefficients from all the others."""
    if edges.size == 2:  # of one record each third
        edges = np.linspace(0, rest.size, 4).astype(np.int64)
    left = 0.0
    for start, stop in pairwise(edges):
        other = np.r_[0:start, stop : rest.size]
        weights = np.linalg.lstsq(matrix[other], rest[other], rcond=None)[0]
        left += float(np.sum((rest[start:stop] - matrix[start:stop] @ weights) ** 2))
    total = float(rest @ rest)
    beyond = total - rest.size
    return (total - left) / beyond if beyond > CHANCE.sigmas * np.sqrt(2.0 * rest.size) else 0.0


def _parity(records: Sequence[Record], at: Tangent) -> str:
    """Whether the remainder is an odd or an even curve over velocity, over displacement, or no curve at all."""
    weights = np.concatenate([np.full(r.measured.size, w) for r, w in zip(records, at.weights, strict=True)])
    force = at.residual / weights
    words = []
    for name, series in (("velocity", "v"), ("displacement", "x")):
        values = np.concatenate([getattr(r.motion, series)[r.window] for r in records])
        odd, even = _odd_and_even(values - (0.0 if series == "v" else np.mean(values)), force)
        total = float(np.mean(force**2))
        if odd + even > TEXT.curve_worth * total:
            kind = (
                "odd"
                if odd > FORM.disproportionate * even
                else "even"
                if even > FORM.disproportionate * odd
                else "neither odd nor even"
            )
            words.append(f"a curve over {name}, {kind}, holds {100 * min((odd + even) / total, 1.0):.0f} % of it")
    return "; ".join(words) or "it is no curve over velocity or displacement alone"


def _odd_and_even(values: Floats, force: Floats) -> tuple[float, float]:
    """Mean squares of the odd and the even part of the mean force over a variable."""
    top = float(np.quantile(np.abs(values), 0.99))
    index = np.clip(((values / top + 1.0) * 0.5 * _BINS).astype(np.int64), 0, _BINS - 1)
    count = np.bincount(index, minlength=_BINS)
    mean = np.bincount(index, weights=force, minlength=_BINS) / np.maximum(count, 1)
    both = (count > 0) & (count[::-1] > 0)
    odd, even = 0.5 * (mean - mean[::-1]), 0.5 * (mean + mean[::-1])
    share = count / count.sum()
    return float(np.sum(share[both] * odd[both] ** 2)), float(np.sum(share[both] * even[both] ** 2))


def _si(value: float, unit: str) -> str:
    """A size with a prefix that suits it, for reading."""
    if unit == "m" and value < 0.1:
        return f"{value * 1e3:.3g} mm"
    if unit == "s" and value < 0.1:
        return f"{value * 1e3:.3g} ms"
    return f"{value:.3g} {unit}"
