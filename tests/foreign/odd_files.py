"""Odd files that hold one and the same run: styles of writing numbers, times and headings that laboratories use."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Final

import numpy as np
from numpy.typing import NDArray

from tests.foreign.dyno_files import FORCE_N, INCH, LBF, TEMPERATURE, TIME, V_M_S, X_M, rows

Floats = NDArray[np.float64]
KGF: Final = 9.80665
X_MM, HEAD = 1e3 * X_M, "Time (s),Stroke (mm),Force (N)\n"


def cells(values: Floats, form: str = "{:.6f}", decimal: str = ".") -> list[str]:
    return [form.format(value).replace(".", decimal) for value in values.tolist()]


def table(columns: Sequence[Sequence[str]], sep: str = ",") -> str:
    return "\n".join(sep.join(row) for row in zip(*columns, strict=True)) + "\n"


def stamps(form: str, fraction: str = ".", begin: datetime = datetime(2026, 3, 1, 10, 12, 13)) -> list[str]:
    """Times of day with milliseconds."""
    at = [begin + timedelta(milliseconds=round(1e3 * t)) for t in TIME.tolist()]
    return [f"{one.strftime(form)}{fraction}{one.microsecond // 1000:03d}" for one in at]


def thousands(separator: str, decimal: str = ".") -> list[str]:
    return [text.replace(",", "_").replace(".", decimal).replace("_", separator) for text in cells(FORCE_N, "{:,.3f}")]


def quoted(values: Floats, decimal: str = ".") -> list[str]:
    return [f'"{text}"' for text in cells(values, decimal=decimal)]


PLAIN: Final = rows([TIME, X_MM, FORCE_N], ",")
CLOCK: Final = "%H:%M:%S"
_MOTION = (cells(X_MM), cells(FORCE_N))
_COMMAS = (cells(X_MM, decimal=","), cells(FORCE_N, decimal=","))
_GERMAN, _SEMI = "Zeit (s);Weg (mm);Kraft (N)\n", HEAD.replace(",", ";")
_FORTRAN = [cells(a, "{:.9E}") for a in (TIME, X_MM, FORCE_N)]

READ: Final[dict[str, str | bytes]] = {
    "times of day": "Time,Stroke (mm),Force (N)\n" + table([stamps(CLOCK), *_MOTION]),
    "times of day, decimal comma": "Zeit;Weg (mm);Kraft (N)\n" + table([stamps(CLOCK, ","), *_COMMAS], ";"),
    "times of day, colon": "Time,Stroke (mm),Force (N)\n" + table([stamps(CLOCK, ":"), *_MOTION]),
    "times over midnight": "Time,Stroke (mm),Force (N)\n"
    + table([stamps(CLOCK, begin=datetime(2026, 3, 1, 23, 59, 58)), *_MOTION]),
    "ISO 8601": "Timestamp,Stroke (mm),Force (N)\n" + table([stamps("%Y-%m-%dT%H:%M:%S"), *_MOTION]),
    "German date": "Datum Uhrzeit;Weg (mm);Kraft (N)\n" + table([stamps("%d.%m.%Y %H:%M:%S", ","), *_COMMAS], ";"),
    "seconds since 1970": "Timestamp (ms),Stroke (mm),Force (N)\n"
    + table([cells(1e3 * TIME + 1.7672256e12, "{:.0f}"), *_MOTION]),
    "Fortran's exponent": HEAD + table(_FORTRAN).replace("E", "D"),
    "Fortran's exponent, columns": HEAD.replace(",", "  ") + table(_FORTRAN, "  ").replace("E", "D"),
    "typographic minus": _SEMI + rows([TIME, X_MM, FORCE_N], ";").replace("-", "−"),
    "quoted numbers": HEAD + table([quoted(a) for a in (TIME, X_MM, FORCE_N)]),
    "quoted numbers, decimal comma": _GERMAN + table([quoted(a, ",") for a in (TIME, X_MM, FORCE_N)], ";"),
    "thousands by comma": _SEMI + table([cells(TIME), cells(X_MM), thousands(",")], ";"),
    "thousands by point": _GERMAN + table([cells(TIME, decimal=","), _COMMAS[0], thousands(".", ",")], ";"),
    "thousands by apostrophe": _GERMAN + table([cells(TIME), cells(X_MM), thousands("'")], ";"),
    "thousands by narrow space": _GERMAN + table([cells(TIME, decimal=","), _COMMAS[0], thousands("\u202f", ",")], ";"),
    "thousands in quotes": HEAD + table([cells(TIME), cells(X_MM), [f'"{text}"' for text in thousands(",")]]),
    "two rows of headings, inch": "Time\tStroke\tLoad\nsec\tinch\tlbf\n"
    + rows([TIME, X_M / INCH, FORCE_N / LBF], "\t", form="{:.8f}"),
    "two rows of names, kgf": "Run 1\tRun 1\tRun 1\nTime (s)\tStroke (cm)\tLoad (kgf)\n"
    + rows([TIME, 1e2 * X_M, FORCE_N / KGF], "\t"),
    "angle of the crank": "Time (s),Crank angle (deg),Stroke (mm),Load (lbs),Temp (F)\n"
    + rows([TIME, np.mod(540 * TIME, 360), X_MM, FORCE_N / LBF, 1.8 * TEMPERATURE + 32], ","),
    "velocity alone": "t [s];v [mm/s];F [N]\n" + rows([TIME, 1e3 * V_M_S, FORCE_N], ";", ","),
    "feet and kip": "Time (s),Displacement (ft),Force (kip)\n"
    + rows([TIME, X_M / 0.3048, 1e-3 * FORCE_N / LBF], ",", form="{:.9f}"),
    "micrometres and millinewtons": "Time (µs),Stroke (μm),Force (mN)\n"
    + rows([1e6 * TIME, 1e6 * X_M, 1e3 * FORCE_N], ","),
    "minutes": "Time (min),Stroke (mm),Force (N)\n" + rows([TIME / 60, X_MM, FORCE_N], ",", form="{:.9f}"),
    "mark and semicolons": "\ufeff" + _SEMI + rows([TIME, X_MM, FORCE_N], ";"),
    "UTF-16": (HEAD + PLAIN).encode("utf-16"),
    "sep=": "sep=;\n" + _SEMI + rows([TIME, X_MM, FORCE_N], ";"),
    "a delimiter at each end": (HEAD + PLAIN).replace("\n", ",\n"),
    "a delimiter at the end of data": HEAD + PLAIN.replace("\n", ",\n"),
    "old line ends": (HEAD + PLAIN).replace("\n", "\r"),
    "comments": "# dyno 3\n# Time (s), Stroke (mm), Force (N)\n" + PLAIN,
    "an index": "," + HEAD + table([list(map(str, range(TIME.size))), cells(TIME), *_MOTION]),
    "plus signs": HEAD + table([cells(TIME), cells(X_MM, "{:+.6f}"), cells(FORCE_N, "{:+.6f}")]),
    "no leading zeros": HEAD + PLAIN.replace(",0.", ",.").replace(",-0.", ",-."),
    "bars at the edges": "".join(f"| {line.replace(',', ' | ')} |\n" for line in (HEAD + PLAIN).splitlines()),
    "empty lines": (HEAD + PLAIN).replace("\n", "\n\n"),
    "every other time twice": HEAD + table([cells(np.repeat(TIME[::2], 2), "{:.3f}"), *_MOTION]),
}

_LINES = PLAIN.splitlines(keepends=True)
REFUSED: Final[dict[str, tuple[str, str]]] = {
    "one time twice": (HEAD + "".join([*_LINES[:500], _LINES[499], *_LINES[500:]]), "the time stands twice"),
    "some times twice": (
        HEAD
        + "".join(
            line * (2 if k in (3, 4, 9, 50, 51, 300, 900, 901, 1200, 1500) else 1) for k, line in enumerate(_LINES)
        ),
        "the time stands twice",
    ),
    "rows of a summary": (HEAD + PLAIN + "Max,25.0,780.2\nMin,-25.0,-360.1\n", "line 2002: 'Time' is 'Max'"),
    "a summary below": (HEAD + PLAIN + "\nPeak force (N),780.2\n", "2 columns where the lines before have 3"),
    "a number of the sample alone": ("Sample" + HEAD.removeprefix("Time (s)") + PLAIN, "no time is found"),
    "no headings": (PLAIN, "no displacement"),
    "a word for an overload": (HEAD + PLAIN.replace("\n0.200000,", "\n0.200000,OVER"), "line 102"),
    "units in the cells": (
        "Time,Stroke,Force\n" + table([[f"{one} {u}" for one in cells(a)] for a, u in ((TIME, "s"), (X_MM, "mm"))]),
        "no table of numbers",
    ),
    "an unknown unit": (HEAD.replace("(N)", "(tonf)") + PLAIN, "the unit 'tonf' of 'Force' is unknown"),
    "time that runs back": (HEAD + "".join(reversed(_LINES)), "the time goes back"),
    "days of a spreadsheet": (
        HEAD.replace(" (s)", "") + table([cells(TIME / 86400 + 46000, "{:.10f}"), *_MOTION]),
        "no unit is stated for time",
    ),
    "two tables beside each other": (
        HEAD.strip() + "," + HEAD + table([line.strip().split(",")[k % 3] for line in _LINES] for k in range(6)),
        "2 columns are named",
    ),
}
