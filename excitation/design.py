"""One call for each `damper-rig design` command: from a configuration to an excitation or a plan."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from excitation.checks import one_of
from excitation.door import read_config
from excitation.errors import DesignError
from excitation.kinds import excitation_from_config
from excitation.plan import Test, TestPlan
from excitation.signal import JSON, Excitation

__all__ = ["COMMANDS", "design", "design_file", "remake"]

COMMANDS = ("random-phase", "homogenised", "harmonic")


def design_file(command: str, path: Path | str) -> Excitation | TestPlan:
    """What `damper-rig design COMMAND CONFIG.toml` makes; raises DesignError that begins with the file's
    name.
    """
    path = Path(path)
    config = read_config(path)
    try:
        return design(command, config)
    except DesignError as error:
        raise DesignError(f"{path}: {error}") from error


def design(command: str, config: Mapping[str, JSON]) -> Excitation | TestPlan:
    """An excitation, or a plan where the configuration asks for several levels or realisations or is
    harmonic.

    Raises DesignError, one line.
    """
    one_of("command", command, COMMANDS)
    kind = "multisine" if command == "random-phase" else "homogenised"
    single = {key: value for key, value in config.items() if key not in ("levels", "realisations", "kind")}
    levels, realisations = config.get("levels", [single.get("level", 1.0)]), config.get("realisations", 1)
    if not isinstance(levels, list) or not levels:
        raise DesignError(f"levels is {levels!r}: give a list of shares of the full displacement, above 0, up to 1")
    if type(realisations) is not int or not 1 <= realisations <= 1000:
        raise DesignError(f"realisations is {realisations!r}: it must lie in 1 … 1000")
    if "levels" not in config and realisations == 1:
        return excitation_from_config({**single, "kind": kind})
    return _series({**single, "kind": kind}, levels, realisations)


def _series(config: Mapping[str, JSON], levels: list[JSON], realisations: int) -> TestPlan:
    """Every realisation at every level, the levels rising."""
    first = config.get("realisation", 0)
    tests = [
        Test(
            name=f"level_{number + 1}_realisation_{realisation + 1}",
            excitation=excitation_from_config(
                {**config, "level": level, "realisation": int(str(first)) + realisation}, f"levels[{number}]"
            ),
        )
        for number, level in enumerate(levels)
        for realisation in range(realisations)
    ]
    return TestPlan(tests=tuple(tests), design=config)


def remake(excitation: Excitation) -> Excitation:
    """The excitation made again from the design that it carries: the same bytes.

    Raises DesignError where it carries none (a foreign file).
    """
    if "kind" not in excitation.design:
        raise DesignError("the file holds samples but no design: it cannot be made again")
    return excitation_from_config(excitation.design)
