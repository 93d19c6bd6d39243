"""Units as other programs write them, converted to those of a run file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from rigctl.errors import ForeignFileError
from rigctl.further_axes import FURTHER_AXES

if TYPE_CHECKING:
    import pint

__all__ = ["SI", "Scale", "clean_unit", "fits", "is_spelling", "scale_to_si"]

SI: Final[Mapping[str, str]] = {
    "time": "s",
    "displacement": "m",
    "displacement_command": "m",
    "velocity": "m/s",
    "acceleration": "m/s²",
    "force": "N",
    "current": "A",
    "current_command": "A",
    "temperature": "degC",
    **FURTHER_AXES,
}
"""Unit of each channel that an import can fill, as in the run file."""

_PINT: Final = {"m/s²": "m/s**2", "N·m": "N*m"}  # spelled for pint

# Spellings of loggers, in any case, and what pint calls them. pint itself reads "mil" as an angle, "kn" as knots.
_SPELLINGS: Final[Mapping[str, str]] = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds", "sek", "sekunde", "sekunden", "secondes", "seg"), "s"),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds", "millisekunden"), "ms"),
    **dict.fromkeys(("us", "usec", "µs", "microseconds"), "us"),
    **dict.fromkeys(("m", "meter", "metre", "meters", "metres"), "m"),
    **dict.fromkeys(("mm", "millimeter", "millimetre", "millimeters", "millimetres"), "mm"),
    **dict.fromkeys(("um", "µm", "micron", "microns", "micrometer"), "um"),
    **dict.fromkeys(("in", "inch", "inches", '"'), "inch"),
    **dict.fromkeys(("mil", "mils", "thou"), "thou"),
    **dict.fromkeys(("ft", "foot", "feet"), "foot"),
    **dict.fromkeys(("m/s", "m/sec", "m s-1", "mps"), "m/s"),
    **dict.fromkeys(("mm/s", "mm/sec"), "mm/s"),
    **dict.fromkeys(("in/s", "in/sec", "ips"), "inch/s"),
    **dict.fromkeys(("ft/s", "ft/sec", "fps"), "foot/s"),
    **dict.fromkeys(("m/s²", "m/s2", "m/s^2", "m/s**2", "m/sec²"), "m/s**2"),
    **dict.fromkeys(("n", "newton", "newtons"), "N"),
    **dict.fromkeys(("kn", "kilonewton", "kilonewtons"), "kN"),
    **dict.fromkeys(("lbf", "lb-f", "lb_f"), "lbf"),
    **dict.fromkeys(("kgf", "kp", "kilopond"), "kgf"),
    **dict.fromkeys(("nm", "n·m", "n*m", "n m", "newton meter", "newton metre"), "N*m"),
    **dict.fromkeys(("knm", "kn·m", "kn*m", "kn m"), "kN*m"),
    **dict.fromkeys(("rad", "radian", "radians"), "rad"),
    **dict.fromkeys(("mrad",), "mrad"),
    **dict.fromkeys(("deg", "degree", "degrees", "°", "grad"), "degree"),
    **dict.fromkeys(("a", "amp", "amps", "ampere", "amperes"), "A"),
    **dict.fromkeys(("ma", "milliamp", "milliampere"), "mA"),
    **dict.fromkeys(("°c", "degc", "deg c", "deg. c", "celsius", "grad c", "ºc"), "degC"),
    **dict.fromkeys(("°f", "degf", "deg f", "fahrenheit", "ºf"), "degF"),
    **dict.fromkeys(("k", "kelvin"), "K"),
    **dict.fromkeys(("v", "volt", "volts"), "V"),
    **dict.fromkeys(("mv",), "mV"),
    **dict.fromkeys(("hz",), "Hz"),
    **dict.fromkeys(("bar", "psi", "mpa", "kpa"), "Pa"),  # a pressure: only its kind matters
    **dict.fromkeys(("%", "-", "1", "#"), "dimensionless"),
    "cm": "cm",
    "dm": "dm",
    "cm/s": "cm/s",
    "min": "minute",
    "h": "hour",
    "mn": "MN",
    "dan": "daN",
}
_EXACT: Final[Mapping[str, str]] = {"mN": "mN", "mK": "mK", "MV": "MV", "MA": "mA"}  # where case tells them apart
# What a unit means only for one kind of channel.
_FORCE: Final[Mapping[str, str]] = {"lb": "lbf", "lbs": "lbf", "pound": "lbf", "kg": "kgf", "klb": "kip", "kip": "kip"}
_TEMPERATURE: Final[Mapping[str, str]] = {"c": "degC", "f": "degF"}
_ACCELERATION: Final[Mapping[str, str]] = {"g": "g_0"}
_ONLY: Final[Mapping[str, Mapping[str, str]]] = {
    "force": _FORCE,
    "temperature": _TEMPERATURE,
    "acceleration": _ACCELERATION,
}


# What nearly every file holds, as quantity and factor: pint takes half a second to start, and agrees (tests).
_USUAL: Final[Mapping[str, tuple[str, float]]] = {
    "s": ("time", 1.0),
    "ms": ("time", 1e-3),
    "us": ("time", 1e-6),
    "m": ("length", 1.0),
    "mm": ("length", 1e-3),
    "um": ("length", 1e-6),
    "cm": ("length", 1e-2),
    "m/s": ("velocity", 1.0),
    "mm/s": ("velocity", 1e-3),
    "m/s**2": ("acceleration", 1.0),
    "N": ("force", 1.0),
    "kN": ("force", 1e3),
    "A": ("current", 1.0),
    "mA": ("current", 1e-3),
    "degC": ("temperature", 1.0),
    "V": ("voltage", 1.0),
    "mV": ("voltage", 1e-3),
    "Hz": ("frequency", 1.0),
    "Pa": ("pressure", 1.0),
}


class Scale(tuple[float, float]):
    """Factor and offset of a linear conversion."""

    __slots__ = ()

    def apply(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values in the unit of the run file, (N,); the array itself where they are in it already."""
        factor, offset = self
        if factor == 1.0 and offset == 0.0:
            return values
        return factor * values + offset if offset else factor * values


def clean_unit(text: str) -> str:
    """A unit without brackets and spaces around it, and with one sign for micro."""
    return text.strip().strip("[](){}").strip().replace("μ", "µ").rstrip(".")


def is_spelling(text: str, role: str = "") -> bool:
    """Whether the text is a usual spelling of a unit, for a column of this role if it has one."""
    unit = clean_unit(text)
    return unit in _EXACT or unit.casefold() in _SPELLINGS or unit.casefold() in _ONLY.get(role, {})


def fits(unit: str, role: str) -> bool | None:
    """Whether a unit can be that of a role; None where it is not known."""
    expression = _expression(unit, role)
    if expression is None:
        return None
    return _linear(expression, _PINT.get(SI[role], SI[role])) is not None


def scale_to_si(unit: str, role: str) -> Scale:
    """The conversion of a unit to the one of the run file.

    Raises
    ------
    ForeignFileError
        Where the unit is unknown, or is none of this quantity.
    """
    expression = _expression(unit, role)
    if expression is None:
        raise ForeignFileError(f"{role}: unit {unit!r:.40} is unknown: write one such as {_examples(role)}")
    found = _linear(expression, _PINT.get(SI[role], SI[role]))
    if found is None:
        raise ForeignFileError(f"{role}: {unit!r:.40} is no unit of it: write one such as {_examples(role)}")
    return Scale(found)


def _examples(role: str) -> str:
    if role in FURTHER_AXES:
        return {"m": "mm or m", "rad": "rad or deg", "N": "N or kN", "N·m": "N·m or kN·m"}[FURTHER_AXES[role]]
    return {
        "time": "s or ms",
        "displacement": "mm, m or in",
        "displacement_command": "mm, m or in",
        "velocity": "m/s, mm/s or in/s",
        "force": "N, kN or lbf",
        "temperature": "degC or degF",
        "acceleration": "m/s^2 or g",
    }.get(role, "A or mA")


def _expression(unit: str, role: str) -> str | None:
    """The unit as pint writes it; None where it is unknown."""
    text = clean_unit(unit)
    known = _ONLY.get(role, {}).get(text.casefold()) or _EXACT.get(text) or _SPELLINGS.get(text.casefold())
    if known is not None:
        return known
    return text if _PLAIN.fullmatch(text) and _known_to_pint(text) else None


_PLAIN = re.compile(r"[A-Za-zµ°/*^²³0-9 .·_-]{1,40}")  # no calls, no brackets, nothing long


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry:  # type: ignore[type-arg]  # pint leaves its parameter open
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


@lru_cache(maxsize=256)
def _known_to_pint(text: str) -> bool:
    import pint

    try:
        return _registry().parse_units(text.replace("²", "**2").replace("·", "*")) is not None
    except (pint.PintError, ValueError, TypeError, ArithmeticError, AttributeError, SyntaxError, LookupError):
        return False
    except Exception as error:  # tokenize's own class, which differs from one Python to the next
        if type(error).__name__ == "TokenError":
            return False
        raise


@lru_cache(maxsize=256)
def _linear(expression: str, wanted: str) -> tuple[float, float] | None:
    """Factor and offset from one unit to another; None where they are of two quantities."""
    if expression in _USUAL and wanted in _USUAL:
        (quantity, factor), (due, unit) = _USUAL[expression], _USUAL[wanted]
        return (factor / unit, 0.0) if quantity == due else None
    return _linear_by_pint(expression, wanted)


def _linear_by_pint(expression: str, wanted: str) -> tuple[float, float] | None:
    import pint

    ureg = _registry()
    try:
        unit = ureg.parse_units(expression.replace("²", "**2").replace("·", "*"))
        nought, one = (float(ureg.Quantity(value, unit).to(wanted).magnitude) for value in (0.0, 1.0))
    except (pint.DimensionalityError, pint.OffsetUnitCalculusError):
        return None
    factor = one - nought
    return (_tidy(factor), round(nought, 9))


def _tidy(factor: float) -> float:
    """Without the rounding of a conversion: 0.001, not 0.0010000000000000009."""
    return float(f"{factor:.13g}")
