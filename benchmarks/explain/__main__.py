"""Judge the naming workflow: `python -m benchmarks.explain single:0:40 pair:0:20 -o DIR --workers 2`.

Outcomes are appended to DIR/outcomes.jsonl as they come; a case that the file has already is not run again.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import closing
from functools import partial
from pathlib import Path

from benchmarks.explain.judge import Outcome, judge
from benchmarks.explain.outcomes import collect, executor_for_cases, read
from benchmarks.explain.summary import right, summary, write_picture
from benchmarks.hidden import KINDS, Conditions

# As many cases as the goals ask for, on seeds on which no name was tuned.
GOAL_CASES = ("single:18000:18400", "pair:18000:18200", "triple:18000:18100", "null:18000:18200",
              "unknown:18000:18200", "wrong_base:18000:18030", "gain_drift:18000:18030")  # fmt: skip


def wanted(texts: Sequence[str]) -> list[tuple[str, int]]:
    """Kind and seed of every case that `KIND:FIRST:END` asks for, mixed: a run cut short has seen some of each kind."""
    placed = []
    for text in texts:
        kind, first, end = text.split(":")
        if kind not in KINDS:
            raise SystemExit(f"'{text}': the kind must be one of {', '.join(KINDS)}")
        seeds = range(int(first), int(end))
        placed += [(k / len(seeds), kind, seed) for k, seed in enumerate(seeds)]
    return [(kind, seed) for _, kind, seed in sorted(placed)]


def in_a_line(o: Outcome) -> str:
    """What was hidden, what the workflow said, and a cross where that is not right."""
    said = ", ".join(o.get("names", {})) or o.get("verdict", o.get("error"))
    true = ", ".join(o["true"]) or "nothing of the catalogue"
    return f"{'   ' if right(o) else '✗  '}{o['kind']} {o['seed']}: {true} → {said} ({o.get('seconds', 0.0):.1f} s)"


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.explain", description=__doc__)
    parser.add_argument(
        "cases", nargs="*", default=list(GOAL_CASES), help="KIND:FIRST:END; default: the cases of the goals"
    )
    parser.add_argument("-o", "--output", type=Path, default=Path("bench-explain"))
    parser.add_argument("--workers", type=int, help="cases at once; without it, DAMPER_RIG_WORKERS or one a processor")
    parser.add_argument("--without-periods", action="store_true", help="the same samples as records without a period")
    arguments = parser.parse_args()
    asked = partial(judge, conditions=Conditions(without_periods=arguments.without_periods))
    path = arguments.output / "outcomes.jsonl"
    cases = wanted(arguments.cases)
    done = {(o["kind"], o["seed"]) for o in read(path)}
    with closing(executor_for_cases(arguments.workers)) as executor:
        collect(asked, [c for c in cases if c not in done], path, executor, in_a_line)
    outcomes = [o for o in read(path) if (o["kind"], o["seed"]) in set(cases)]
    print(summary(outcomes))
    write_picture(outcomes, arguments.output / "naming.html")


if __name__ == "__main__":
    main()
