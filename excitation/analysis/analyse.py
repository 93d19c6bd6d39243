"""From measured periods to the best linear approximation, distortion, noise and time variation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.analysis.approximation import Approximation, approximate, pooled_scatter, unsolved
from excitation.analysis.criteria import CONFIDENCE, CORRECTED, FEW_LINES, HOLDS_MOST, LINES_OF_A_SEGMENT, POOLED
from excitation.analysis.levels import Detected, Level, detected, direct, from_neighbours, from_scatter, together
from excitation.analysis.measurement import Measurement
from excitation.analysis.pooled import pooled
from excitation.analysis.realisations import merged, played_lines, settled
from excitation.analysis.result import Analysis, Levels, LineLevels, Response
from excitation.analysis.seen_lines import SeenLines
from excitation.analysis.spectra import LineSpectra, line_spectra, noise_beside
from excitation.analysis.spoiled import spoiled_lines
from excitation.analysis.variation import variation
from excitation.errors import AnalysisError

__all__ = ["analyse"]

Floats = NDArray[np.float64]

_LEAST_DETECTION = 4  # odd detection lines in the band from which a level on the driven lines is told


@dataclass(frozen=True, slots=True, kw_only=True)
class _Nonlinear:
    """Levels of distortion and its power on each driven line."""

    odd: Level | None
    even: Level | None
    both: Level | None
    per_line: Floats | None  # (K,), N², of one realisation
    freedom: Floats | None  # (K,): complex degrees of freedom of that
    method: str
    notes: tuple[str, ...] = ()


def analyse(measurement: Measurement) -> Analysis:
    """Best linear approximation with its uncertainty, odd and even distortion, noise, time variation, coherence.

    With two realisations or more (the robust method) distortion is what differs between them; with lines left out of
    an odd excitation (the fast method) it is what is seen on these, odd and even apart. Both need two periods, to know
    the noise.

    Raises
    ------
    AnalysisError
        one line, where the realisations do not go together or nothing can be told of them.

    References
    ----------
    Pintelon & Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapters 3 to 6: best
    linear approximation, robust and fast method, odd and even distortion.
    """
    ready, played = merged(settled(measurement))
    spectra = [line_spectra(one) for one in ready.realisations]
    lines, told = played_lines(ready, spectra)
    over_rate = ready.inputs[0] == "displacement"
    linear = approximate(spectra, lines)
    _check_solved(linear, lines, ready, len(spectra))
    found = detected(spectra, linear, lines, over_rate=over_rate)
    nonlinear = _nonlinear(spectra, linear, lines, found)
    mean_noise, noise = _noise(spectra, lines.driven, linear.value)
    variance = _variance(linear, nonlinear, mean_noise)
    notes = (
        *told,
        *spoiled_lines(dict(zip(ready.inputs, lines.excited, strict=True))),
        *nonlinear.notes,
        *_on_solved(linear, lines, len(spectra)),
        *_on_few(linear, lines),
        *_on_noise(spectra),
        *_on_correction(found),
    )
    spacing = ready.sample_rate_hz / ready.samples
    unknown = np.full(noise.size, np.nan)
    rest = unknown if nonlinear.per_line is None else np.maximum(nonlinear.per_line, 0.0)
    quiet = np.zeros(noise.size) if _known(spectra) else unknown
    return Analysis(
        sample_rate_hz=ready.sample_rate_hz,
        samples=ready.samples,
        played=played,
        method=nonlinear.method,
        lines=lines,
        responses=_responses(ready, linear, lines, variance, _circle(nonlinear, noise.size)),
        frequency_hz=np.asarray(lines.driven * spacing, dtype=np.float64),
        coherence=_coherence(linear, rest, mean_noise, noise),
        noise_coherence=_coherence(linear, quiet, mean_noise, noise),
        levels=_levels(spectra, linear, lines, found, nonlinear),
        spectrum=_spectrum(spectra, lines, found, spacing),
        variation=variation(spectra, lines.driven),
        notes=notes,
    )


def _nonlinear(spectra: Sequence[LineSpectra], linear: Approximation, lines: SeenLines, found: Detected) -> _Nonlinear:
    """By whichever method knows the distortion on the driven lines from more numbers."""
    inner, count = lines.inside(lines.odd), len(spectra)
    noise = _noise(spectra, lines.driven, linear.value)[0]
    even = direct(found.of(lines.even)) if lines.splits else None
    told = _direct_of(found, lines.odd if lines.splits else lines.mixed)
    by_scatter = linear.spare * int(np.sum(np.isfinite(linear.scatter)))
    neighbours = count * inner.size if inner.size >= _LEAST_DETECTION else 0
    if lines.driven.size < FEW_LINES:
        few = f"{lines.driven.size} driven lines: distortion is what is seen beside them, as harmonics, of this motion"
        both = together([told, even]) if even is not None else told
        odd = told if lines.splits else None
        return _Nonlinear(odd=odd, even=even, both=both, per_line=None, freedom=None, method="harmonics", notes=(few,))
    if not max(by_scatter, neighbours):
        return _unknown(lines, even)
    if by_scatter > neighbours:
        level, method = (
            from_scatter(linear, noise, min(one.freedom for one in spectra), count),
            f"scatter over {count} realisations",
        )
        per_line = pooled_scatter(linear) - pooled(noise, POOLED)
        freedom = np.full(per_line.size, float(POOLED))
    else:
        near = from_neighbours(found.of(inner), lines.driven, pooled(noise, POOLED), count)
        level, per_line, freedom = near.level, near.per_line, near.freedom
        method = f"{inner.size} odd detection lines"
    whole = together([level, told])
    if even is None:
        return _Nonlinear(
            odd=None, even=None, both=whole, per_line=per_line, freedom=freedom, method=method, notes=(_ALL_LINES,)
        )
    return _Nonlinear(
        odd=whole, even=even, both=together([whole, even]), per_line=per_line, freedom=freedom, method=method
    )


_ALL_LINES = (
    "even lines are driven: odd and even distortion are not told apart; design both channels with lines = 'odd-random'"
)


def _unknown(lines: SeenLines, even: Level | None) -> _Nonlinear:
    """One realisation and no line to detect distortion on the driven lines."""
    what = "odd distortion" if lines.splits else "distortion"
    note = (
        f"{what} is not known, one realisation drives every {'odd ' if lines.splits else ''}line of its band: play "
        "another realisation, or lines = 'odd-random'; the uncertainty is that of the noise alone"
    )
    return _Nonlinear(
        odd=None, even=even, both=None, per_line=None, freedom=None, method="one realisation", notes=(note,)
    )


def _direct_of(found: Detected, lines: NDArray[np.int64]) -> Level:
    return direct(found.of(lines))


def _check_solved(linear: Approximation, lines: SeenLines, measurement: Measurement, count: int) -> None:
    if unsolved(linear, lines) < lines.driven.size:
        return
    raise AnalysisError(
        f"{measurement.realisations[0].name}: {' and '.join(measurement.inputs)} drive the same lines and {count} "
        "realisation is given: their effects are told apart from 2 realisations on (design … realisations = 4)"
    )


def _on_solved(linear: Approximation, lines: SeenLines, count: int) -> tuple[str, ...]:
    lost = unsolved(linear, lines)
    if not lost:
        return ()
    why = "one realisation cannot tell them apart: play 4" if count == 1 else "they are too alike in these realisations"
    return (f"on {lost} of {lines.driven.size} lines displacement and current drive both, and {why}",)


def _on_few(linear: Approximation, lines: SeenLines) -> tuple[str, ...]:
    squares = float(np.sum(linear.linear**2))
    number = float(np.sum(linear.linear)) ** 2 / squares if squares > 0.0 else 0.0
    if lines.driven.size < FEW_LINES or number >= HOLDS_MOST:
        return ()
    return (
        f"{number:.1f} of {lines.driven.size} driven lines hold most of the force: the bounds of odd distortion are "
        "too narrow for so few; play more realisations, or a flatter spectrum",
    )


def _on_noise(spectra: Sequence[LineSpectra]) -> tuple[str, ...]:
    if _known(spectra):
        return ()
    single = next(one.name for one in spectra if one.periods < 2)
    return (
        f"{single} has one settled period: the noise is not known and counts as distortion; play 3 periods or more, "
        "of which the first settles",
    )


def _on_correction(found: Detected) -> tuple[str, ...]:
    """Where the rig itself moves on lines that are to be quiet."""
    made, left = float(np.sum(found.corrected)), float(np.sum(np.maximum(found.power, 0.0)))
    if made <= CORRECTED * (made + left):
        return ()
    return (
        f"the rig itself moves or feeds the lines that are to be quiet: its force there, {np.sqrt(made):.3g} N rms, "
        f"was taken off by the linear approximation, {np.sqrt(left):.3g} N rms are left; a rig that follows its "
        "command better tells smaller distortions",
    )


def _known(spectra: Sequence[LineSpectra]) -> bool:
    return all(one.periods > 1 for one in spectra)


def _noise(
    spectra: Sequence[LineSpectra], lines: NDArray[np.int64], g: NDArray[np.complex128]
) -> tuple[Floats, Floats]:
    """Variance of Y − G·U on lines by noise, of the mean of a run's periods and of one, mean over the runs, N²."""
    each = [noise_beside(one, g, lines) for one in spectra]
    mean = np.mean([noise / one.periods for noise, one in zip(each, spectra, strict=True)], axis=0)
    return mean, np.mean(each, axis=0)


def _variance(linear: Approximation, nonlinear: _Nonlinear, mean_noise: Floats) -> Floats:
    """Of the force on a driven line about the linear part in one realisation, (K,), N²; NaN where not known."""
    if nonlinear.per_line is None:
        return np.full(mean_noise.size, np.nan)
    if linear.spare:
        return pooled_scatter(linear)
    return np.maximum(nonlinear.per_line, 0.0) + pooled(mean_noise, POOLED)


def _circle(nonlinear: _Nonlinear, lines: int) -> Floats:
    """Square of the radius that holds G with ``CONFIDENCE`` over its variance, (K,): the quantile of F(2, 2n)."""
    if nonlinear.freedom is None:
        return np.full(lines, np.nan)
    from scipy.special import fdtri  # 0.2 s to import: only where distortion is told by detection lines

    return np.asarray(fdtri(2.0, 2.0 * nonlinear.freedom, CONFIDENCE), dtype=np.float64)


_UNITS = {"displacement": "N/m", "current": "N/A"}


def _responses(
    measurement: Measurement, linear: Approximation, lines: SeenLines, variance: Floats, circle: Floats
) -> tuple[Response, ...]:
    """Force over every input; over the velocity it is that over the displacement, divided by jω."""
    out = []
    spacing = measurement.sample_rate_hz / measurement.samples
    for i, name in enumerate(measurement.inputs):
        keep = np.flatnonzero(np.isfinite(linear.value[i]))
        at = lines.driven[keep]
        one = Response(
            over=name,
            unit=_UNITS.get(name, "N"),
            lines=at,
            frequency_hz=np.asarray(at * spacing, dtype=np.float64),
            value=linear.value[i, keep],
            std=np.sqrt(linear.gain[i, keep] * variance[keep]),
            bound=np.sqrt(linear.gain[i, keep] * variance[keep] * circle[keep]),
            noise_std=linear.noise_std[i, keep],
        )
        out.append(one)
        if name == "displacement":
            omega = 2.0 * np.pi * one.frequency_hz
            out.append(
                Response(
                    over="velocity",
                    unit="N·s/m",
                    lines=at,
                    frequency_hz=one.frequency_hz,
                    value=one.value / (1j * omega),
                    std=one.std / omega,
                    bound=one.bound / omega,
                    noise_std=one.noise_std / omega,
                )
            )
    return tuple(out)


def _coherence(linear: Approximation, distortion: Floats, mean_noise: Floats, noise: Floats) -> Floats:
    """γ² = L/(L + distortion + noise of one period), (K,), L the linear part less what G takes up of the rest."""
    part = np.maximum(linear.linear - linear.taken * (distortion + mean_noise), 0.0)
    total = part + distortion + noise
    out: Floats = np.divide(part, total, out=np.full(total.size, np.nan), where=total > 0.0)
    return out


def _levels(
    spectra: Sequence[LineSpectra], linear: Approximation, lines: SeenLines, found: Detected, nonlinear: _Nonlinear
) -> Levels:
    every = np.sort(np.concatenate([lines.driven, found.lines]))
    one_period = float(np.mean([np.mean(np.sum(np.abs(one.each[:, every]) ** 2, axis=1)) for one in spectra]))
    variance = float(np.sum(np.mean([one.noise[every] for one in spectra], axis=0)))
    noise = None
    if _known(spectra):
        free = sum(one.freedom for one in spectra) * every.size
        spread = 1.96 * variance / float(np.sqrt(free))
        noise = Level(power=variance, low=variance - spread, high=variance + spread)
    part = float(np.sum(linear.linear))
    if nonlinear.per_line is not None:  # what G takes up of the distortion
        part -= float(np.nansum(np.maximum(nonlinear.per_line, 0.0))) * linear.taken
    return Levels(
        force_rms=float(np.sqrt(one_period)),
        linear_rms=float(np.sqrt(max(part, 0.0))),
        odd=nonlinear.odd,
        even=nonlinear.even,
        nonlinear=nonlinear.both,
        noise=noise,
    )


def _spectrum(
    spectra: Sequence[LineSpectra], lines: SeenLines, found: Detected, spacing: float
) -> tuple[LineLevels, ...]:
    """Force, distortion on the lines that show it, and noise, for a picture."""
    force = np.mean([np.abs(one.force[lines.driven]) ** 2 for one in spectra], axis=0)
    out = [_line_levels("force", lines.driven, force, spacing)]
    for kind, at in (("odd", lines.odd), ("even", lines.even), ("odd and even", lines.mixed)):
        if at.size:
            part = found.of(at)
            out.append(_line_levels(kind, part.lines, part.power + part.noise, spacing, part.power))
    if _known(spectra):
        every = np.sort(np.concatenate([lines.driven, found.lines]))
        noise = np.mean([one.noise[every] / one.periods for one in spectra], axis=0)
        out.append(_line_levels("noise", every, noise, spacing))
    return tuple(out)


def _line_levels(
    kind: str, lines: NDArray[np.int64], power: Floats, spacing: float, smooth: Floats | None = None
) -> LineLevels:
    mean = pooled(power if smooth is None else smooth, LINES_OF_A_SEGMENT if kind != "noise" else POOLED)
    return LineLevels(
        kind=kind,
        lines=lines,
        frequency_hz=np.asarray(lines * spacing, dtype=np.float64),
        rms=np.sqrt(power),
        smooth=np.sqrt(np.maximum(mean, 0.0)),
    )
