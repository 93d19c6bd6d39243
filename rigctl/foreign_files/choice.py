"""What an import takes from a file: stated by the user, kept in the run file, and used again for the next file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from math import isfinite
from typing import Any, Final

from excitation.kinds import Kind
from rigctl.errors import ForeignFileError
from rigctl.foreign_files.layout import DELIMITERS, TextOptions
from rigctl.foreign_files.units import SI
from rigctl.further_axes import FURTHER_AXES

__all__ = ["CHANNELS", "Choice", "ColumnChoice", "choice_from", "column_choice"]

CHANNELS: Final = tuple(SI)
_TURNED: Final = ("displacement", "velocity", "force", "acceleration", *FURTHER_AXES)


@dataclass(frozen=True, slots=True, kw_only=True)
class ColumnChoice:
    """One column by its name, "#3" for the third; ``unit`` "" where the file states it."""

    column: str
    unit: str = ""

    def __str__(self) -> str:
        return f"{self.column}:{self.unit}" if self.unit else self.column


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """Everything that can be stated about a file from elsewhere; the defaults leave it to be guessed.

    ``columns`` by channel; "none" as column name: the channel is not taken. ``flip``: channels whose sign is turned.
    ``centre``: channels whose mean is taken off. ``rate_hz``: the sample rate where no column has the time;
    ``resample_hz``: the rate to which samples at uneven times are interpolated.
    """

    columns: Mapping[str, ColumnChoice] = field(default_factory=dict)
    flip: tuple[str, ...] = ()
    centre: tuple[str, ...] = ()
    rate_hz: float | None = None
    resample_hz: float | None = None
    part: str = ""
    encoding: str | None = None
    delimiter: str | None = None
    decimal: str | None = None
    header_lines: int | None = None
    specimen: str = ""
    kind: str = ""

    def __post_init__(self) -> None:
        for name in self.columns:
            _one_of(name, CHANNELS, "channel")
        for name in (*self.flip, *self.centre):
            _one_of(name, _TURNED, "--flip or --centre")
        for name, rate in (("--rate", self.rate_hz), ("--resample", self.resample_hz)):
            if rate is not None and not (isfinite(rate) and 0.0 < rate <= 1e7):
                raise ForeignFileError(f"{name} is {rate:g}: it must be above 0 and at most 1e7 Hz")
        if self.delimiter is not None:
            _one_of(self.delimiter, DELIMITERS, "--delimiter")
        if self.decimal is not None:
            _one_of(self.decimal, ("point", "comma"), "--decimal")
        if self.header_lines is not None and self.header_lines < 0:
            raise ForeignFileError(f"--header-lines is {self.header_lines}: it must be 0 or more")
        if self.kind:
            _one_of(self.kind, tuple(Kind), "--kind")

    @property
    def text(self) -> TextOptions:
        """What is stated of a text file."""
        return TextOptions(
            encoding=self.encoding,
            delimiter=None if self.delimiter is None else DELIMITERS[self.delimiter],
            decimal=None if self.decimal is None else {"point": ".", "comma": ","}[self.decimal],
            header_lines=self.header_lines,
        )

    def with_more(self, stated: Choice) -> Choice:
        """This choice with what another one states in place of its own."""
        nothing = Choice()
        more = {
            f.name: getattr(stated, f.name)
            for f in fields(Choice)
            if getattr(stated, f.name) != getattr(nothing, f.name)
        }
        mine = {f.name: getattr(self, f.name) for f in fields(Choice)}
        return Choice(**{**mine, **more, "columns": {**self.columns, **stated.columns}})

    def as_json(self) -> dict[str, Any]:
        """JSON of what is stated; `choice_from` reads it again."""
        nothing = asdict(Choice())
        found = {name: value for name, value in asdict(self).items() if value != nothing[name]}
        if self.columns:
            found["columns"] = {name: str(one) for name, one in self.columns.items()}
        return {name: list(value) if isinstance(value, tuple) else value for name, value in found.items()}


def choice_from(table: object, where: str) -> Choice:
    """A choice from JSON or from a table of a mapping file; a channel may stand outside of ``columns`` too.

    Raises ForeignFileError that names the key.
    """
    if not isinstance(table, dict):
        raise ForeignFileError(f"{where}: it must be a table of keys and values")
    known = {f.name for f in fields(Choice)}
    columns: dict[str, ColumnChoice] = {}
    stated: dict[str, Any] = {}
    for key, value in table.items():
        if key == "columns" and isinstance(value, dict):
            columns |= {str(name): column_choice(_text(one, f"{where}: {name}")) for name, one in value.items()}
        elif key in CHANNELS:
            columns[key] = column_choice(_text(value, f"{where}: {key}"))
        elif key in known:
            stated[key] = _checked(key, value, where)
        else:
            usual = ", ".join((*CHANNELS, *sorted(known - {"columns"})))
            raise ForeignFileError(f"{where}: key {key!r:.40} is unknown: {usual} are known")
    try:
        return Choice(columns=columns, **stated)
    except ForeignFileError as error:
        raise ForeignFileError(f"{where}: {error}") from error


def column_choice(text: str) -> ColumnChoice:
    """ "Zeit:s" as column and unit; the unit may be left out, and a name may hold colons: "Load: cell 1:kN"."""
    name, colon, unit = text.rpartition(":")
    if not text.strip():
        raise ForeignFileError("the name of a column is empty: write NAME or NAME:UNIT")
    if not colon:
        return ColumnChoice(column=text.strip())
    return ColumnChoice(column=name.strip(), unit=unit.strip())


def _checked(key: str, value: object, where: str) -> object:
    if key in ("flip", "centre"):
        listed = [value] if isinstance(value, str) else value
        if not isinstance(listed, list):
            raise ForeignFileError(f"{where}: {key} is {value!r:.40}: it must be a list of channels")
        return tuple(_text(one, f"{where}: {key}") for one in listed)
    if key in ("rate_hz", "resample_hz"):
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise ForeignFileError(f"{where}: {key} is {value!r:.40}: it must be a number, Hz")
        return float(value)
    if key == "header_lines":
        if isinstance(value, bool) or not isinstance(value, int):
            raise ForeignFileError(f"{where}: {key} is {value!r:.40}: it must be a whole number")
        return value
    return _text(value, f"{where}: {key}")


def _text(value: object, where: str) -> str:
    if not isinstance(value, str) or len(value) > 400:
        raise ForeignFileError(f"{where} is {value!r:.40}: it must be text of at most 400 characters")
    return value


def _one_of(name: str, known: object, what: str) -> None:
    names = [str(one) for one in known] if isinstance(known, list | tuple | dict) else []
    if name not in names:
        raise ForeignFileError(f"{what}: {name!r:.40} is unknown: {', '.join(names)} are known")
