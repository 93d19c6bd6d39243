"""A search for regressors on runs: what is offered, on which share of the samples, its path, and what each is worth."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from identification.blackbox.preparation import absent_signals, at_one_rate, course_of, learnable, measured_signals
from identification.blackbox.recipes import RECIPES
from identification.blackbox.selection import Known, Step, Tried, candidates, select, without_each
from identification.blackbox.selectionfile import read_selection, write_selection
from identification.blackbox.share import fair_share
from identification.blackbox.structure import SYMBOLS, Regressor, Structure, regressors
from identification.blackbox.training import scales_of
from identification.errors import DataError
from rigctl.runfile import Run

Told = Callable[[float, str], None]

KINDS = ("nnoe", "narx", "mlp", "arx")
LONGEST = 5  # samples: the longest delay that is offered, as Witters and Swevers (2009) offer it
SHORTLIST = 5  # of the most promising regressors that are trained at once
MOST = 12  # regressors

# Samples that the structures are trained on. Half: what is rare is learned from a few samples; double: the search takes
# twice as long.
SAMPLES = 8192


@dataclass(frozen=True, slots=True, kw_only=True)
class Offer:
    """What a search may choose from, and how: `shortlist` None trains every structure, as the original method does."""

    nodes: int | None = None
    longest: int = LONGEST
    shortlist: int | None = SHORTLIST
    most: int = MOST

    def __post_init__(self) -> None:
        if not 1 <= self.longest <= 20:
            raise DataError(f"the longest delay is {self.longest} samples: it must lie within 1 … 20")


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """The path of a search, how many structures were trained, and the result anew without each of its signals."""

    path: tuple[Step, ...]
    trained: int
    known: Known
    without: Mapping[str, Tried]

    @property
    def found(self) -> Tried:
        """What the search ended with."""
        return self.path[-1].tried


def search(
    kind: str,
    runs: Sequence[Run],
    *,
    offer: Offer | None = None,
    rate_hz: float | None = None,
    state: Path | None = None,
    tell: Told | None = None,
) -> Search:
    """Search the regressors of a kind by the error in free run, on a fair share of long runs.

    `state` is the file of the search: it is written after every step, and read where it is there already, so that an
    interrupted search goes on.

    Raises
    ------
    DataError
        one line, where the kind has no such search, the runs can't be used, or the file is of another search.
    """
    check_searchable(kind)
    if not runs:
        raise DataError("no run was given: at least one measured run is needed")
    asked, say = offer or Offer(), tell or (lambda done, text: None)
    runs = at_one_rate(learnable(runs)[0], rate_hz)
    courses = [course_of(one, measured_signals(runs)) for one in runs]
    symbols = _symbols(kind, absent_signals(runs, courses))
    courses = fair_share(courses, SAMPLES)
    scales = scales_of(courses, [SYMBOLS[one] for one in symbols if one != "F"])
    known = {} if state is None else read_selection(state, courses)
    steps: list[Step] = []

    def on_step(step: Step, tried: Known) -> None:
        steps.append(step)
        known.update(tried)
        size = len(step.tried.structure.regressors)
        say(min(size / asked.most, 0.95), f"{step.act}: {step.tried.rrmsse:.2f} %, {len(tried)} structures")
        if state is not None:
            write_selection(state, courses, steps, tried)

    path = select(
        courses, scales, _start(kind, symbols, asked), _offered(symbols, asked), known=known, most=asked.most,
        shortlist=asked.shortlist, on_step=on_step,
    )  # fmt: skip
    say(0.95, "without each signal")
    without = without_each(path[-1].tried, courses, scales, symbols=symbols)
    return Search(path=tuple(path), trained=len(known), known=known, without=without)


def check_searchable(kind: str) -> None:
    """Raise DataError where no search finds regressors of a kind."""
    if kind not in KINDS:
        raise DataError(f"regressors can be searched for {', '.join(KINDS)}, not for {kind!r}")


def _symbols(kind: str, absent: Sequence[str]) -> list[str]:
    """The signals that a kind may see."""
    given = "xvaiT" if kind == "mlp" else "FxvaiT"
    return [one for one in given if SYMBOLS[one] not in absent]


def _start(kind: str, symbols: Sequence[str], asked: Offer) -> Structure:
    """Past force, velocity and current, as far as there are."""
    first = [one for one in regressors("F1 v1 i1") if one.symbol in symbols]
    nodes = RECIPES[kind].nodes if asked.nodes is None else asked.nodes
    return Structure(tuple(first), 0 if kind == "arx" else nodes)


def _offered(symbols: Sequence[str], asked: Offer) -> list[Regressor]:
    """All delays of each; a temperature does not change within five samples."""
    fast = candidates([one for one in symbols if one != "T"], asked.longest)
    return fast + candidates([one for one in symbols if one == "T"], 0)
