"""Headings of columns: the name and the unit in one text, and the quantity that a name means, in several languages."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from rigctl.foreign_files.units import clean_unit, fits, is_spelling

__all__ = ["Head", "role_of", "split_heading", "suits"]


@dataclass(frozen=True, slots=True)
class Head:
    """One column before it is read: what it is called, and its unit as the file writes it, "" where it does not."""

    name: str
    unit: str = ""
    stamps: bool = False  # dates or times of day
    number: bool = True  # False: a column of text


# Words of a name, after accents and case are removed: English, German, French, Spanish, Italian, Portuguese, Dutch.
_WORDS: Final[dict[str, str]] = {
    "time": r"x value|time|timestamp|timestamps|\w*zeit|zeit\w*|temps|tiempo|tempo|tijd|elapsed|datum|date|uhrzeit",
    "displacement": r"displ|displ?acement\w*|disp|stroke|position|pos|travel|lvdt|extension|elongation|\w*(?<!be)weg|"
    r"wegaufnehmer|weg\w*|\w*hub|verschiebung|auslenkung|deplacement|course|desplazamiento|posicion|carrera|recorrido|"
    r"spostamento|corsa|posizione|deslocamento|curso|posicao|verplaatsing|slag",
    "force": r"force|load|loadcell|\w*kraft|kraft\w*|effort|charge|fuerza|carga|forza|carico|forca|kracht",
    "velocity": r"velocity|speed|vel|\w*geschwindigkeit|vitesse|velocidad|velocita|velocidade|snelheid",
    "acceleration": r"acceleration|accel|acc|\w*beschleunigung|aceleracion|accelerazione|aceleracao|versnelling",
    "current": r"current|\w*strom|courant|corriente|corrente|stroom",
    "temperature": r"temperature|temp|\w*temperatur|temperatura|temperatuur",
}
# Names that are nothing but a symbol.
_LETTERS: Final[dict[str, tuple[str, ...]]] = {
    "time": ("t",),
    "displacement": ("x", "s", "z"),
    "force": ("f", "fx", "fz"),
    "velocity": ("v",),
    "acceleration": ("a",),
    "current": ("i",),
}
_COMMAND: Final = re.compile(
    r"\b(command\w*|cmd|setpoint|set|soll|soll\w+|consigne|demand\w*|target|reference|ref|desired|consigna|comando|drive)\b"
)


@lru_cache(maxsize=1 << 15)
def role_of(head: Head) -> tuple[str, int]:
    """The quantity that a column seems to be, and how sure: 2 a word, 1 a letter; ("", 0) where nothing tells."""
    words = _plain(head.name)
    found, sure = _named(words), 2
    if not found:
        letter = re.sub(r"[\W_\d]+", "", head.name).casefold()
        found, sure = next((role for role, letters in _LETTERS.items() if letter in letters), ""), 1
    if found in ("displacement", "current") and _COMMAND.search(words):
        return f"{found}_command", sure
    if _COMMAND.search(words):
        by_unit = next(
            (role for role in ("displacement", "current") if not found and head.unit and fits(head.unit, role)), ""
        )
        return (f"{by_unit}_command", 1) if by_unit else ("", 0)
    return (found, sure) if found else ("", 0)


def suits(head: Head, role: str) -> bool:
    """Whether its unit is one of the role, or is not stated."""
    return head.number and (not head.unit or bool(fits(head.unit, role)))


def _named(words: str) -> str:
    for role, pattern in _WORDS.items():
        if re.search(rf"\b(?:{pattern})\b", words):
            return role
    return ""


def _plain(name: str) -> str:
    """Words in lower case without accents: "KolbenWeg_mm" → "kolben weg mm" and "kolbenweg"."""
    text = unicodedata.normalize("NFKD", name)
    text = "".join(c for c in text if not unicodedata.combining(c)).replace("ß", "ss")
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    return " ".join(re.sub(r"[\W_\d]+", " ", part).casefold() for part in (text, apart)).strip()


_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[\[({<](?P<unit>[^\[\](){}<>]{0,24})[\])}>]\s*$")
_APART = re.compile(r"^(?P<name>.+?)(?:\s*/\s*|\s*,\s*|\s+in\s+|\s*:\s*|[ _.]+)(?P<unit>[^\s,_]{1,12}?)\s*$")


def split_heading(text: str) -> Head:
    """Name and unit of "Force (N)", "Kraft [kN]", "Weg in mm", "Stroke, mm", "F/kN", "disp_mm"; unit "" for none."""
    tidy = " ".join(text.replace("\ufeff", "").split())
    bracketed = _BRACKETS.match(tidy)
    if bracketed and bracketed["name"]:
        return Head(bracketed["name"].strip(), clean_unit(bracketed["unit"]))
    apart = _APART.match(tidy)
    if apart and _is_unit_of(apart["unit"], apart["name"]):
        return Head(apart["name"].strip(), clean_unit(apart["unit"]))
    return Head(tidy)


def _is_unit_of(unit: str, name: str) -> bool:
    """A single letter is a unit only behind the name of a quantity that has it: "Force N", and not "Sensor A"."""
    role, _ = role_of(Head(name))
    if role:
        return is_spelling(unit, role) and fits(unit, role) is True
    return len(unit) > 1 and is_spelling(unit)
