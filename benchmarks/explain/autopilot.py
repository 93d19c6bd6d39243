"""Rig time of the autopilot compared with that of a fixed plan: `python -m benchmarks.explain.autopilot -o DIR`.

Both begin with the same first run, a multisine of the machine's whole envelope. The fixed plan goes on with the other
runs of the campaign that every case has, 16 to 20 s each, in their order. Each ends by the autopilot's rule: every
name is sure, and the names explain the gap or did not change with one more test. Compared are the time of motion after
the first run, and whether the names are right. Outcomes are appended to DIR/autopilot.jsonl as they come; cases that
the file has already are not run again.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import numpy as np

from api.campaigns.autopilot import autopilot, settled
from benchmarks.explain.judge import Outcome
from benchmarks.explain.outcomes import collect, executor_for_cases, read
from benchmarks.hidden import Bench, bench
from excitation.plan import Test
from identification.discrepancy import Explanation, explain
from identification.physical.modelfile import model_from_json
from rigctl.runfile import Run

BUDGET_S = 150.0
FIRST = 1  # training runs at the start: the multisine over the whole envelope


def both_ways(kind: str, seed: int) -> Outcome:
    """What the autopilot and the fixed plan find on one specimen."""
    one = bench(seed, kind)
    return {
        "kind": kind, "seed": seed, "true": sorted(one.case.effects), "family": one.case.detail["family"],
        "autopilot": _by_autopilot(one), "plan": _by_plan(one),
    }  # fmt: skip


def _explained(one: Bench, runs: Sequence[Run]) -> Explanation:
    return explain(model_from_json(one.case.base_model), runs)


def _by_autopilot(one: Bench) -> Outcome:
    asked: list[str] = []

    def played(test: Test) -> Run:
        asked.append(f"{test.excitation.kind} {test.excitation.duration_s:.1f} s")
        return one.play(test.excitation, len(asked))

    first = [one.case.runs[FIRST]]
    rounds = autopilot(first, explain=lambda runs: _explained(one, runs), play=played, budget_s=BUDGET_S)
    before = rounds[-2].found if len(rounds) > 1 else None
    return {**_told(rounds[-1].found, before, rounds[-1].rig_seconds), "tests": asked, "ended": rounds[-1].ended}


def _by_plan(one: Bench) -> Outcome:
    first = one.case.runs[FIRST]
    rest = [run for run in one.case.runs if run is not first]
    spent, found, before = 0.0, _explained(one, [first]), None
    for k, run in enumerate(rest):
        if settled(found, before):
            break
        spent += run.samples / run.sample_rate_hz
        found, before = _explained(one, [first, *rest[: k + 1]]), found
    return _told(found, before, spent)


def _told(found: Explanation, before: Explanation | None, seconds: float) -> Outcome:
    names = {e.element: e.confidence for e in found.effects}
    return {"verdict": str(found.verdict), "names": names, "seconds": seconds, "sure": settled(found, before)}


def is_sure_and_right(way: Outcome, true: Sequence[str]) -> bool:
    """Whether every name was sure at the end, and all of them right."""
    return bool(way["sure"]) and sorted(way["names"]) == list(true)


def summary(outcomes: Sequence[Outcome]) -> str:
    """How often each way ends with names that are sure and right, and the rig time where both ways do."""
    lines = []
    for way in ("autopilot", "plan"):
        ends = [is_sure_and_right(o[way], o["true"]) for o in outcomes]
        wrong = [o[way]["sure"] and not ok for o, ok in zip(outcomes, ends, strict=True)]
        time = np.mean([o[way]["seconds"] for o in outcomes])
        lines.append(
            f"{way:<10} sure and right {np.mean(ends):.0%}, sure and wrong {np.mean(wrong):.0%} of {len(outcomes)}; "
            f"{time:.1f} s of motion on average"
        )
    both = [o for o in outcomes if all(is_sure_and_right(o[way], o["true"]) for way in ("autopilot", "plan"))]
    if both:
        ours, theirs = (np.array([o[way]["seconds"] for o in both]) for way in ("autopilot", "plan"))
        lines.append(
            f"where both are ({len(both)}): {ours.sum():.0f} s against {theirs.sum():.0f} s, "
            f"{ours.sum() / max(theirs.sum(), 1e-9):.2f} of the plan's; median {np.median(ours):.1f} s against "
            f"{np.median(theirs):.1f} s"
        )
    return "\n".join(lines)


def in_a_line(o: Outcome) -> str:
    """How both ways ended on one specimen, in one line."""
    parts = []
    for way in ("autopilot", "plan"):
        names = ", ".join(f"{n} {c:.2f}" for n, c in o[way]["names"].items()) or o[way]["verdict"]
        parts.append(f"{way} {o[way]['seconds']:.1f} s {'' if is_sure_and_right(o[way], o['true']) else '✗ '}{names}")
    return (
        f"{o['seed']} {', '.join(o['true'])}: {'; '.join(parts)}; {o['autopilot']['tests']} {o['autopilot']['ended']}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.explain.autopilot", description=__doc__)
    parser.add_argument("--seeds", default="9500:9540", help="FIRST:END of the specimens")
    parser.add_argument("--kind", default="single")
    parser.add_argument("-o", "--output", type=Path, default=Path("bench-explain"))
    parser.add_argument("--workers", type=int, help="cases at once; without it, DAMPER_RIG_WORKERS or one a processor")
    arguments = parser.parse_args()
    path = arguments.output / "autopilot.jsonl"
    seeds = range(*(int(text) for text in arguments.seeds.split(":")))
    done = {(o["kind"], o["seed"]) for o in read(path)}
    todo = [(arguments.kind, seed) for seed in seeds if (arguments.kind, seed) not in done]
    with closing(executor_for_cases(arguments.workers)) as executor:
        collect(both_ways, todo, path, executor, in_a_line)
    print(summary([o for o in read(path) if o["kind"] == arguments.kind and o["seed"] in seeds]))


if __name__ == "__main__":
    main()
