"""Random sequences of commands, late frames, faults and losses of power against the model of who may move the rig.

The state machine of tests/sim_rig/test_state_machine.py, with 10 000 sequences of 40 steps.
``python -m benchmarks.bench_rig_sequences 500`` plays 500.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

TEST = Path(__file__).parents[1] / "tests" / "sim_rig" / "test_state_machine.py"


def main(sequences: float = 10_000) -> None:
    """Raises SystemExit where a sequence moved the rig although nobody had asked for it."""
    began = time.perf_counter()
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(TEST)]
    ended = subprocess.run(
        command, env={**os.environ, "DAMPER_RIG_SEQUENCES": str(int(sequences))}, check=False, capture_output=True
    )
    took = time.perf_counter() - began
    if ended.returncode:
        print(ended.stdout.decode()[-6000:])
        raise SystemExit("a sequence moved the rig although nobody had asked for it")
    print(f"{int(sequences)} random sequences of 40 steps: no motion that nobody asked for; {took:.0f} s")


if __name__ == "__main__":
    main(*(float(word) for word in sys.argv[1:]))
