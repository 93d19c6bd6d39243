"""The tests of a plan or excitation file from elsewhere: what the reading process does with one."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from excitation.errors import DesignError, ExcitationError, ExcitationFileError
from excitation.files import read_plan
from excitation.plan import Test, conditions_of, config_of, test_from_config
from excitation.plan_files import holds_a_plan, read_plan_config
from excitation.signal import JSON, Excitation
from excitation.synthesis import excitation_from_config, reads_a_file
from excitation.untrusted import parse_json

__all__ = ["MOST_PLAN_BYTES", "MOST_SAMPLE_BYTES", "channels_of", "plan_content"]

MOST_TEXT_BYTES: Final = 1 << 20  # of a plan as TOML or CSV: 500 tests have 0.2 MB
# Of the configurations as JSON: escapes make six bytes of one.
MOST_PLAN_BYTES: Final = 6 * MOST_TEXT_BYTES
# Of all set-points of a file that no design makes again: an hour of displacement and current at 1 kHz is 58 MB. The
# service holds twice as much while it takes such a file, and reads two at once.
MOST_SAMPLE_BYTES: Final = 64 << 20
_DESIGN_CPU_S: Final = (
    8.0  # for making designs again; tests beyond it keep their samples, which is as right. CPU_S ends it
)
_ROUNDING: Final = 1e-9  # of the largest value: what a design differs by from processor to processor is below 1e-12


def plan_content(path: Path) -> tuple[dict[str, Any], list[Excitation]]:
    """``tests``, ``warm_up`` and ``excitations`` as JSON (Any), and these excitations; of text nothing is designed.

    A test that no design makes again has the number of its excitation.

    Raises ExcitationError, one line that names the file.
    """
    try:
        content = _of_text(path) if _is_text(path) else _of_samples(path)
        excitations = content["excitations"]
        content["excitations"] = [_described(one) for one in excitations]
        text = json.dumps(content)
        parse_json(text)  # TOML has nan; a value that is not JSON has ended the line before
    except ExcitationError:
        raise
    except (TypeError, ValueError) as error:
        reason = " ".join(str(error).split())[:160]
        raise ExcitationFileError(f"{path}: {reason}: a plan has texts, finite numbers and lists of them") from error
    except (RecursionError, MemoryError) as error:
        raise ExcitationFileError(f"{path}: nested too deeply, or too large: divide the plan into several") from error
    if len(text) > MOST_PLAN_BYTES:
        raise ExcitationFileError(f"{path}: its tests take {len(text)} bytes: at most {MOST_PLAN_BYTES} are kept")
    return content, excitations


def _is_text(path: Path) -> bool:
    """Whether it is a plan in TOML or CSV; raises ExcitationFileError where it is too large for one."""
    ending = path.suffix.lower()
    if ending != ".toml" and not (ending == ".csv" and holds_a_plan(path)):
        return False
    if path.stat().st_size > MOST_TEXT_BYTES:
        raise ExcitationFileError(f"{path}: a plan as text has at most {MOST_TEXT_BYTES} bytes: write it as .h5")
    return True


def _of_text(path: Path) -> dict[str, Any]:
    config = read_plan_config(path)
    if further := sorted(set(config) - {"tests", "warm_up"}):
        raise ExcitationFileError(f"{path}: {further[0]!a:.60} is not a known key: known are tests, warm_up")
    tests, warm_up = config.get("tests"), config.get("warm_up")
    if not isinstance(tests, list) or not all(isinstance(test, dict) for test in tests):
        raise ExcitationFileError(f"{path}: tests is {str(tests)!a:.60}: it must be a list of tables")
    if warm_up is not None and not isinstance(warm_up, dict):
        raise ExcitationFileError(f"{path}: warm_up is {str(warm_up)!a:.60}: it must be a table")
    return {"tests": tests, "warm_up": warm_up, "excitations": []}


def _of_samples(path: Path) -> dict[str, Any]:
    """Tests whose design makes them again as their configurations, the others with the number of their excitation."""
    plan, ends = read_plan(path, _without_files), time.process_time() + _DESIGN_CPU_S
    excitations: list[Excitation] = []

    def config(test: Test) -> dict[str, Any]:
        design = test.excitation.design
        if "kind" in design and not reads_a_file(design) and time.process_time() < ends:
            remade = config_of(test)
            if _makes_it_again(remade, test.excitation):
                return dict(remade)
        excitations.append(test.excitation)
        return {"name": test.name, "excitation": len(excitations) - 1, **conditions_of(test)}

    tests = [config(test) for test in plan.tests]
    warm_up = None if plan.warm_up is None else config(plan.warm_up)
    size = sum(values.nbytes for one in excitations for values in channels_of(one))
    if size > MOST_SAMPLE_BYTES:
        raise ExcitationFileError(
            f"{path}: its set-points take {size} bytes as numbers: at most {MOST_SAMPLE_BYTES} are kept of a file: "
            "divide it into several"
        )
    return {"tests": tests, "warm_up": warm_up, "excitations": excitations}


def _without_files(config: Mapping[str, JSON], where: str) -> Excitation:
    """The excitation of a design; raises DesignError where it would read a file of this computer."""
    if reads_a_file(config):
        record = Path(str(config.get("record"))).name
        raise DesignError(
            f"{where}: {record!a:.80} is a file of the computer that sent the plan: send it with 'damper-rig campaign "
            "submit', which sends the samples of its records too"
        )
    return excitation_from_config(config, where)


def _makes_it_again(config: Mapping[str, Any], excitation: Excitation) -> bool:
    """Whether a design makes the set-points of the file: another program may have changed these alone. Any: JSON."""
    try:
        made = test_from_config(dict(config)).excitation
    except ExcitationError:
        return False
    pairs = zip(channels_of(made), channels_of(excitation), strict=False)
    alike = (made.sample_rate_hz, len(channels_of(made))) == (excitation.sample_rate_hz, len(channels_of(excitation)))
    return alike and all(_is_same(one, other) for one, other in pairs)


def _is_same(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Whether two signals differ by no more than the rounding of another processor."""
    return one.size == other.size and bool(
        np.all(np.abs(one - other) <= _ROUNDING * np.max(np.abs(other), initial=0.0))
    )


def _described(excitation: Excitation) -> dict[str, Any]:
    """What an excitation has beside its samples, as JSON. Any: JSON."""
    return {
        "kind": str(excitation.kind),
        "sample_rate_hz": excitation.sample_rate_hz,
        "period_samples": excitation.period_samples,
        "samples": excitation.samples,
        "with_current": excitation.current_a is not None,
        "design": excitation.design,
        "figures": excitation.figures,
    }


def channels_of(excitation: Excitation) -> tuple[NDArray[np.float64], ...]:
    """Displacement, m, and where it is driven current, A; (N,) each."""
    current = excitation.current_a
    return (excitation.displacement_m,) if current is None else (excitation.displacement_m, current)
