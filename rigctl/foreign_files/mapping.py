"""A mapping file: what is stated once for all files of an archive, and what holds for some of them."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

from rigctl.errors import ForeignFileError
from rigctl.foreign_files.choice import Choice, choice_from

__all__ = ["Mapping", "Rule", "read_mapping"]

_MOST_BYTES = 1 << 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """What holds for the files whose name, with its folders, fits a pattern such as "*/2024/*.csv"."""

    match: str
    choice: Choice
    skip: bool = False
    split: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Mapping:
    """Rules in their order; the first holds for every file."""

    rules: tuple[Rule, ...]

    def of(self, name: str) -> Rule:
        """Everything that holds for one file: a later rule counts before an earlier one."""
        choice, skip, split = Choice(), False, False
        for rule in self.rules:
            if fnmatch(name, rule.match) or fnmatch(Path(name).name, rule.match):
                choice, skip, split = choice.with_more(rule.choice), skip or rule.skip, split or rule.split
        return Rule(match=name, choice=choice, skip=skip, split=split)


def read_mapping(path: Path) -> Mapping:
    """Read a mapping file; raises ForeignFileError that names the file and the key."""
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise ForeignFileError(f"{path}: larger than {_MOST_BYTES} bytes: a mapping is a short TOML file")
        content = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise ForeignFileError(f"{path}: cannot be read ({error.strerror or error})") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ForeignFileError(f"{path}: not a TOML file: {error}") from error
    some = content.pop("files", [])
    if not isinstance(some, list):
        raise ForeignFileError(f"{path}: files: write [[files]] for each pattern")
    rules = [_rule(content, f"{path}", "*")]
    for n, table in enumerate(some, start=1):
        where = f"{path}: files, table {n}"
        if not isinstance(table, dict) or not isinstance(table.get("match"), str):
            raise ForeignFileError(f'{where}: match is missing: a pattern such as "*_cold.csv"')
        rules.append(_rule(table, where, table.pop("match")))
    return Mapping(rules=tuple(rules))


def _rule(table: dict[str, object], where: str, match: str) -> Rule:
    flags = {}
    for name in ("skip", "split"):
        value = table.pop(name, False)
        if not isinstance(value, bool):
            raise ForeignFileError(f"{where}: {name} is {value!r:.40}: it must be true or false")
        flags[name] = value
    return Rule(match=match, choice=choice_from(table, where), **flags)
