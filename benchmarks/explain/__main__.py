"""Judge the naming workflow: `python -m benchmarks.explain single:0:40 pair:0:20 -o DIR --workers 2`.

Outcomes are appended to DIR/outcomes.jsonl as they come; what is there already is not run again.
"""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from benchmarks.explain.judge import Outcome, judge
from benchmarks.explain.summary import right, summary, write_picture
from benchmarks.hidden import KINDS

# As many cases as the goals ask for, on seeds that the workflow was never looked at with.
SEALED = ("single:9000:9400", "pair:9000:9200", "triple:9000:9100", "null:9000:9200", "unknown:9000:9200",
          "wrong_base:9000:9100", "gain_drift:9000:9100")  # fmt: skip


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


def read(path: Path) -> list[Outcome]:
    """Outcomes so far; a last line that an interruption cut short is left out."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return [json.loads(line) for line in lines if line.endswith("}")]


def run(todo: Sequence[tuple[str, int]], path: Path, workers: int) -> None:
    """Judge the cases in parallel, each outcome a line of `path`."""
    with (
        ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool,
        path.open("a", encoding="utf-8") as file,
    ):
        waiting = [pool.submit(judge, kind, seed) for kind, seed in todo]
        for number, done in enumerate(as_completed(waiting), 1):
            outcome = done.result()
            file.write(json.dumps(outcome) + "\n")
            file.flush()
            said = ", ".join(outcome.get("names", {})) or outcome.get("verdict", outcome.get("error"))
            mark = "   " if right(outcome) else "✗  "
            true = ", ".join(outcome["true"]) or "nothing of the catalogue"
            print(f"{mark}{number}/{len(todo)} {outcome['kind']} {outcome['seed']}: {true} → {said} "
                  f"({outcome.get('seconds', 0.0):.1f} s)", flush=True)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.explain", description=__doc__)
    parser.add_argument("cases", nargs="*", default=list(SEALED), help="KIND:FIRST:END; without any, the sealed ones")
    parser.add_argument("-o", "--output", type=Path, default=Path("bench-explain"))
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    path = arguments.output / "outcomes.jsonl"
    cases = wanted(arguments.cases)
    done = {(o["kind"], o["seed"]) for o in read(path)}
    run([c for c in cases if c not in done], path, arguments.workers)
    outcomes = [o for o in read(path) if (o["kind"], o["seed"]) in set(cases)]
    print(summary(outcomes))
    write_picture(outcomes, arguments.output / "naming.html")


if __name__ == "__main__":
    main()
