"""Write hidden cases: ``python -m benchmarks.hidden --kind single --seeds 0:20 -o DIR``."""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks.hidden.case import KINDS, case
from benchmarks.hidden.storage import write_case


def _seeds(text: str) -> range:
    first, _, last = text.partition(":")
    return range(int(first), int(last) if last else int(first) + 1)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.hidden", description=__doc__)
    parser.add_argument("--kind", choices=KINDS, required=True)
    parser.add_argument("--seeds", type=_seeds, required=True, help="FIRST:END, or one number")
    parser.add_argument("-o", "--output", type=Path, required=True, help="one folder for each case is made here")
    arguments = parser.parse_args()
    for seed in arguments.seeds:
        made = case(seed, arguments.kind)
        folder = write_case(made, arguments.output / f"{arguments.kind}-{seed:04d}")
        print(f"{folder}: {', '.join(made.effects) or 'nothing of the catalogue'}, {made.excess:.1f} × noise")


if __name__ == "__main__":
    main()
