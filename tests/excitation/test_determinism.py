"""The same configuration gives the same bytes on every processor."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

CODE = """
import hashlib
from excitation.synthesis import excitation_from_config
base = dict(sample_rate=500.0, period_samples=2048, seed=3,
            displacement=dict(f_min=0.5, f_max=20.0, spectrum="quarter-car", max_displacement=0.06,
            max_velocity=1.5), current=dict(f_min=0.5, f_max=50.0, min=0.3, max=1.6))
sine = dict(kind="sine", sample_rate=1000.0, amplitude=0.0123, frequency=3.21, cycles=3)
whole = [
    sine,
    sine | dict(kind="triangle", corner_time=0.01),
    base | dict(kind="multisine"),
    base | dict(kind="multisine", phases="crest", period_samples=256),
    base | dict(kind="homogenised", homogenise=dict(method="duym", iterations=40)),
    base | dict(kind="homogenised", homogenise=dict(iterations=60)),
    base | dict(kind="homogenised", homogenise=dict(variables=["displacement", "velocity"], iterations=40),
                response=dict(displacement=dict(bandwidth=40.0, order=2))),
]
digest = hashlib.sha256()
for config in whole:
    made = excitation_from_config(config)
    digest.update(made.displacement_m.tobytes())
    digest.update(b"" if made.current_a is None else made.current_a.tobytes())
print(digest.hexdigest())
"""

MACHINES = {
    "no vector units, no fused multiply-add": {
        "NPY_DISABLE_CPU_FEATURES": "X86_V4 X86_V3",
        "OPENBLAS_CORETYPE": "Nehalem",
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F",
    },
    "code for a generic processor": {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""},
}


def digest(environment: dict[str, str], cache: Path) -> str:
    home = str(Path(__file__).parents[2])
    full = os.environ | {"PYTHONPATH": home} | environment
    if "NUMBA_CPU_NAME" in environment:
        full["NUMBA_CACHE_DIR"] = str(cache)
    command = [sys.executable, "-W", "ignore", "-c", CODE]  # numpy warns of features this machine lacks
    return subprocess.run(command, env=full, check=True, capture_output=True, text=True, timeout=300).stdout


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> str:
    return digest({}, tmp_path_factory.mktemp("cache"))


@pytest.mark.slow
@pytest.mark.parametrize("machine", MACHINES)
def test_the_same_configuration_gives_the_same_bytes_on_a_lesser_machine(
    machine: str, here: str, tmp_path: Path
) -> None:
    assert digest(MACHINES[machine], tmp_path) == here
