"""What half and double of each number that decides change: `python -m benchmarks.explain.sensitivity pair:14000:14010`.

Cases are judged with every number of CHANCE and FORM as it is, halved and doubled, one at a time; a line tells which
names or verdicts that changed and the largest change of a confidence.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields

from benchmarks.explain.__main__ import wanted
from benchmarks.explain.judge import Outcome, judge
from identification.compute import Serial, using
from identification.criteria import CHANCE, FORM, Chance, Form

FACTORS = (0.5, 2.0)


@contextmanager
def changed(group: Chance | Form, name: str, factor: float) -> Iterator[None]:
    """The number times a factor, for as long as it is asked for; in this process only."""
    own = getattr(group, name)
    object.__setattr__(group, name, type(own)(own * factor))
    try:
        yield
    finally:
        object.__setattr__(group, name, own)


def differences(before: Sequence[Outcome], after: Sequence[Outcome]) -> str:
    """Which cases have other names or another verdict, and the largest change of a confidence in the rest."""
    words, most = [], 0.0
    for a, b in zip(before, after, strict=True):
        if (sorted(a.get("names", ())), a.get("verdict")) != (sorted(b.get("names", ())), b.get("verdict")):
            words.append(f"{a['kind']} {a['seed']}: {_answer(a)} → {_answer(b)}")
        else:
            most = max([most, *(abs(c - b["names"][n]) for n, c in a.get("names", {}).items())])
    return "; ".join([*words, f"confidences to {most:.2f}"])


def _answer(o: Outcome) -> str:
    return f"{', '.join(sorted(o.get('names', ()))) or 'no name'} ({o.get('verdict', o.get('error'))})"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.explain.sensitivity", description=__doc__)
    parser.add_argument("cases", nargs="+", help="KIND:FIRST:END")
    parser.add_argument("--only", action="append", default=[], help="name of a number; without it, all")
    arguments = parser.parse_args()
    cases = wanted(arguments.cases)
    with using(Serial()):
        before = [judge(kind, seed) for kind, seed in cases]
        for group in (CHANCE, FORM):
            for name in (f.name for f in fields(group) if not arguments.only or f.name in arguments.only):
                for factor in FACTORS:
                    with changed(group, name, factor):
                        after = [judge(kind, seed) for kind, seed in cases]
                    words = differences(before, after)
                    print(f"{type(group).__name__.upper()}.{name} × {factor:g}: {words}", flush=True)


if __name__ == "__main__":
    main()
