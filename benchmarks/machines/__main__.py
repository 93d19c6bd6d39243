"""Judge the naming workflow on machines: ``python -m benchmarks.machines --first SEED --cases N --out FILE.jsonl.gz``.

Outcomes are kept beside FILE while they come, as FILE without `.gz`, and a case that is there already is not run again.
Seeds below 100 000 are for development, from 900 000 on they are sealed. With `--write DIR` the cases are only written.
With `--measured FOLDER` known effects are added to measured runs (run files, a folder for each
set; or a recorder's text files).
"""

from __future__ import annotations

import argparse
import gzip
from collections.abc import Sequence
from contextlib import closing
from functools import partial
from pathlib import Path

from benchmarks.explain.outcomes import collect, executor_for_cases, read
from benchmarks.machines.case import case
from benchmarks.machines.figures import in_a_line, summary, summary_of_injections
from benchmarks.machines.judge import judge, judge_injection
from benchmarks.machines.kinds import KINDS
from benchmarks.machines.measured import measured_sets
from benchmarks.machines.storage import write_case
from benchmarks.machines.variants import VARIANTS


def main(words: Sequence[str] | None = None) -> None:
    """Run the command; `words` stand for those of the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.machines", description=__doc__)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--cases", type=int, default=24)
    parser.add_argument("--out", type=Path, default=Path("bench-machines/outcomes.jsonl.gz"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--kinds", nargs="+", choices=tuple(KINDS), default=tuple(KINDS))
    parser.add_argument("--stability", action="store_true", help="ask again with halves, other held-out runs, …")
    parser.add_argument("--once", action="store_true", help="do not ask again with the found model")
    parser.add_argument("--beside", action="store_true", help="beside an effect outside of the catalogue in every case")
    parser.add_argument("--summary", action="store_true", help="only read FILE")
    parser.add_argument("--measured", type=Path, help="add known effects to the runs in this folder instead")
    parser.add_argument("--write", type=Path, help="write the cases as files into folders here, and judge nothing")
    arguments = parser.parse_args(words)
    kinds, seeds = tuple(arguments.kinds), range(arguments.first, arguments.first + arguments.cases)
    if arguments.write is not None:
        for seed in seeds:
            print(write_case(case(seed, kinds), arguments.write / f"machine-{seed:06d}"))
        return
    if arguments.measured is not None and not measured_sets(arguments.measured):
        print(f"{arguments.measured}: no folder with three measured runs or more, nothing is added to them")
        return
    kept = arguments.out.with_suffix("") if arguments.out.suffix == ".gz" else arguments.out
    if not arguments.summary:
        _run(kinds, seeds, kept, arguments)
        if arguments.out.suffix == ".gz":
            arguments.out.write_bytes(gzip.compress(kept.read_bytes(), mtime=0))
    outcomes = read(arguments.out)
    if arguments.measured is not None:
        print(summary_of_injections([o for o in outcomes if o["source"] == "injection"]))
    else:
        print(summary([o for o in outcomes if o["source"] == "machine" and o["kind"] in kinds]))


def _run(kinds: tuple[str, ...], seeds: range, kept: Path, arguments: argparse.Namespace) -> None:
    if not kept.exists() and arguments.out.exists():
        kept.write_bytes(gzip.decompress(arguments.out.read_bytes()))
    done = {o["seed"] for o in read(kept)}
    variants = VARIANTS if arguments.stability else ()
    asked = partial(judge, kinds=kinds, again=not arguments.once, variants=variants, beside=arguments.beside)
    if arguments.measured is not None:
        asked = partial(judge_injection, folder=str(arguments.measured), again=not arguments.once)
    with closing(executor_for_cases(arguments.jobs)) as executor:
        collect(asked, [(seed,) for seed in seeds if seed not in done], kept, executor, in_a_line)


if __name__ == "__main__":
    main()
