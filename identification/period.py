"""The period of a run: seen in every input of the model, stated by the file or not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identification.criteria import CHANCE, FORM
from rigctl.runfile import Run

Floats = NDArray[np.float64]

SHORTEST = 8  # samples of a period
_INPUTS = ("displacement", "current")  # the temperature may drift: it is not averaged
_LEADING = 3  # one part of so many of a run may be transient
_EXACT = 1e-4  # share of the rms: the digits of a file and the rounding of a simulation stray by less
_PICK_UP_A = (
    0.01  # rms: coils and valves of dampers take some tenths of an ampere to some; less is picked up by a sensor
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Repetition:
    """The run with the period that its inputs show, 0 for none; `differs`: the input that does not repeat as stated."""

    run: Run
    differs: str = ""
    note: str = ""  # where the period is not what the file states


def with_period_seen(run: Run) -> Repetition:
    """The run with the period of its inputs in place of the stated one.

    A stated period holds where neither displacement nor current strays from its mean period by more than the root of
    what is material in the force: the mean force belongs to the mean motion to first order, and what is left of the
    second order is then too small to matter. A period that is not stated is sought; as nobody vouches for it, it holds
    where every input repeats exactly. Noise of a sensor is no straying.
    """
    stated = run.period_samples
    if stated < SHORTEST or run.samples < 2 * stated:
        found = _sought(run)
        if not found:
            return Repetition(run=run)
        note = f"its inputs repeat after {found} samples: used as its period"
        return Repetition(run=replace(run, period_samples=found), note=note)
    for channel in _INPUTS:
        if channel in run.channels and (share := _straying(run, channel, stated)) > np.sqrt(FORM.material):
            note = (
                f"it does not repeat after {stated} samples, which period_samples states: its periods differ by "
                f"{100 * share:.2g} % rms; the run is treated as one without a period"
            )
            return Repetition(run=replace(run, period_samples=0), differs=channel, note=note)
    return Repetition(run=run)


def _straying(run: Run, channel: str, period: int) -> float:
    """Rms by which the late periods of an input differ from their mean beyond white noise, as a share of its rms."""
    values = run.channels[channel]
    whole = values[: values.size // period * period].reshape(-1, period)
    if len(whole) > 2:
        late = whole[min(-(-len(whole) // _LEADING), len(whole) - 2) :]
    elif channel == "current":
        late = whole  # it is commanded: the first of two periods is like the other
    else:
        return 0.0  # the only period after the transient one: nothing to compare it with
    if channel == "displacement":
        size = float(np.std(late))
    else:
        size = max(float(np.sqrt(np.mean(late**2))), _PICK_UP_A / np.sqrt(FORM.material))
    stray = late - late.mean(axis=0)
    white = 0.5 * float(np.mean(np.diff(stray.ravel()) ** 2))
    # Of white noise, variance and half the mean square of the steps differ by 1/√n of it (von Neumann, 1941).
    smooth = float(np.mean(stray**2)) - white * (1.0 + CHANCE.sigmas / np.sqrt(stray.size))
    return float(np.sqrt(max(smooth, 0.0))) / size if size > 0.0 else 0.0


def _sought(run: Run) -> int:
    """The shortest period after which displacement and current repeat; 0 where they do not."""
    x = run.channels.get("displacement")
    if x is None or x.size < _LEADING * SHORTEST:
        return 0
    late = x[x.size // _LEADING :] - np.mean(x[x.size // _LEADING :])
    most = x.size // _LEADING + 2  # three whole periods or more, and one lag to see that it is the least
    unlike = _unlike(late, most)
    apart = np.flatnonzero(unlike > float(np.mean(late**2)))
    if not apart.size:
        return 0
    inner = np.arange(max(int(apart[0]), SHORTEST), most)
    lowest = inner[:-1][(unlike[inner[:-1]] <= unlike[inner[:-1] - 1]) & (unlike[inner[:-1]] <= unlike[inner[1:]])]
    # Noise alone differs from noise by twice its variance at every lag; a true period is among the least of all.
    near = lowest[unlike[lowest] <= 2.0 * float(np.min(unlike[lowest], initial=np.inf)) + _tiny(late)]
    shown = [c for c in _INPUTS if c in run.channels]
    holds = (int(p) for p in near if all(_straying(run, c, int(p)) <= _EXACT for c in shown))
    return next(holds, 0)


def _unlike(signal: Floats, most: int) -> Floats:
    """Mean square of s[k + L] - s[k] for every lag L below `most`, (most,)."""
    n = signal.size
    padded = np.fft.rfft(signal, 2 * n)
    products = np.fft.irfft(np.abs(padded) ** 2, 2 * n)[:most]
    squares = np.concatenate([[0.0], np.cumsum(signal**2)])
    lags = np.arange(most)
    both = squares[n - lags] + (squares[n] - squares[lags])
    return np.asarray(np.maximum(both - 2.0 * products, 0.0) / (n - lags))


def _tiny(signal: Floats) -> float:
    """The rounding of the mean squares of a signal."""
    return 1e-12 * float(np.mean(signal**2))
