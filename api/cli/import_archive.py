"""Many files for ``damper-rig import``: which they are, where their runs go, and what happened to each."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from api.cli.import_shown import run_figures, shown
from api.cli.places import check_file, check_folder
from api.cli.terminal import ProgressBar, progress_bar
from api.errors import InputError, one_line
from identification.datachecks import findings_of_import
from rigctl.errors import ForeignFileError
from rigctl.foreign_files import ENDINGS, Imported, Mapping, import_file
from rigctl.runfile import write_run

__all__ = ["Archive", "import_all"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A file, its name within the archive, and the name of its run file there."""

    path: Path
    name: str
    run: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What became of one file: its runs and where they are, or why it was refused."""

    source: Source
    runs: tuple[tuple[Path, Imported], ...] = ()
    findings: tuple[str, ...] = ()
    refusal: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Archive:
    """What became of all files."""

    outcomes: tuple[Outcome, ...]

    @property
    def refused(self) -> int:
        return sum(bool(one.refusal) for one in self.outcomes)

    def text(self) -> str:
        """One file in full, several a line each."""
        if len(self.outcomes) == 1:
            return shown(self.outcomes[0].runs)
        width = max((len(one.source.name) for one in self.outcomes), default=4)
        lines = [f"{one.source.name:<{width}}  {_line(one)}" for one in self.outcomes]
        runs = sum(len(one.runs) for one in self.outcomes)
        return "\n".join([*lines, f"{len(lines)} files, {runs} runs, {self.refused} refused"])

    def as_json(self) -> list[dict[str, Any]]:
        return [
            {
                "source": str(one.source.path),
                "refused": one.refusal or None,
                "runs": [run_figures(path, run) for path, run in one.runs],
                "findings": list(one.findings),
            }
            for one in self.outcomes
        ]


def _line(one: Outcome) -> str:
    if one.refusal:
        return f"refused: {one.refusal}"
    first = one.runs[0][1].run
    what = f"{len(one.runs)} runs" if len(one.runs) > 1 else f"{first.samples} samples"
    notes = [*one.findings, *one.runs[0][1].told]
    more = f"; {notes[0]}" + (f" (and {len(notes) - 1} more)" if len(notes) > 1 else "") if notes else ""
    return f"{what}, {first.sample_rate_hz:.5g} Hz{more}"


def import_all(files: Sequence[Path], output: Path, rules: Mapping, *, write: bool) -> Archive:
    """Import every file; a single one that is refused is an error, one of several an outcome.

    Raises
    ------
    InputError
        Where there is no file, or where the output cannot be written, before any file is read.
    ForeignFileError
        Where the only file is refused.
    """
    sources = [source for source in _sources(files) if not rules.of(source.name).skip]
    if not sources:
        raise InputError(f"{files[0]}: no file to read: files that end in {', '.join(ENDINGS)} are")
    single = len(sources) == 1 and output.suffix == ".h5"
    if not single and output.suffix == ".h5" and len(sources) > 1:
        raise InputError(f"{output}: one run file for {len(sources)} files: give a folder")
    if write:
        _check_place(output, single=single)
    outcomes = []
    with progress_bar("importing") as tell:
        for k, source in enumerate(sources):
            outcomes.append(_one(source, output, rules, (k, len(sources)), tell, write=write))
    for one in outcomes:
        _say(one, alone=len(sources) == 1)
    return Archive(outcomes=tuple(outcomes))


def _one(
    source: Source, output: Path, rules: Mapping, turn: tuple[int, int], tell: ProgressBar, *, write: bool
) -> Outcome:
    rule, (k, count) = rules.of(source.name), turn
    try:
        found = import_file(
            source.path,
            rule.choice,
            split=rule.split,
            tell=lambda done: tell((k + 0.9 * done) / count, f"importing {source.path.name}"),
        )
        runs = tuple(zip(_places(source, output, len(found)), found, strict=True))
        for place, one in runs if write else ():
            place.parent.mkdir(parents=True, exist_ok=True)
            write_run(place, one.run)
    except ForeignFileError as error:
        if count == 1:
            raise
        return Outcome(source=source, refusal=one_line(error).removeprefix(f"{source.path}: "))
    return Outcome(source=source, runs=runs, findings=tuple(_findings(runs)))


def _sources(files: Sequence[Path]) -> list[Source]:
    """The files, and those in folders that end as data do; with the folder in the name where two have the same."""
    found = [pair for path in files for pair in (_inside(path) if path.is_dir() else [(path, path.name)])]
    names = Counter(name for _, name in found)
    found = [(path, name if names[name] == 1 else f"{path.parent.name}/{name}") for path, name in found]
    runs = Counter(str(Path(name).with_suffix(".h5")) for _, name in found)
    return [Source(path=path, name=name, run=_run_name(name, runs)) for path, name in found]


def _run_name(name: str, runs: Counter[str]) -> str:
    """The name with the ending .h5 in place of its own, or behind it where another file would get the same."""
    usual = str(Path(name).with_suffix(".h5"))
    return usual if runs[usual] == 1 else f"{name}.h5"


def _inside(folder: Path) -> Iterator[tuple[Path, str]]:
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if (
            path.suffix.casefold() in ENDINGS
            and path.is_file()
            and not any(part.startswith(".") for part in name.parts)
        ):
            yield path, name.as_posix()


def _check_place(output: Path, *, single: bool) -> None:
    """Raise InputError where nothing could be written, before any file is read."""
    if single and output.parent.exists():
        check_file(output)
    elif single:
        check_folder(output.parent, output.name)
    else:
        check_folder(output)


def _places(source: Source, output: Path, runs: int) -> list[Path]:
    first = output if output.suffix == ".h5" else output / source.run
    if runs == 1:
        return [first]
    return [first.with_name(f"{first.stem}-{k:02d}.h5") for k in range(1, runs + 1)]


def _findings(runs: Sequence[tuple[Path, Imported]]) -> Iterator[str]:
    """What the data checks find in the runs, with the option that would help."""
    for place, one in runs:
        for finding in findings_of_import(one.run):
            more = ": --flip force, if that is so" if finding.kind == "polarity" else ""
            before = f"{place.name}: " if len(runs) > 1 else ""
            yield f"{before}{finding}{more}"


def _say(one: Outcome, *, alone: bool) -> None:
    """Notes of a single file on standard error; those of several are in the table."""
    if not alone:
        return
    for text in (*(note for _, run in one.runs for note in run.told), *one.findings):
        print(f"damper-rig: {one.source.path}: {text}", file=sys.stderr)
