"""One call for each `damper-rig design` command: from a configuration to an excitation or a plan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from excitation.checks import check_one_of
from excitation.configuration import read_config, to_config, to_spec
from excitation.envelope import Envelope, check, check_plan, read_envelope, scale_to_fit
from excitation.errors import DesignError, EnvelopeError
from excitation.files import read_excitation, read_plan
from excitation.harmonic_plan import harmonic_plan
from excitation.kinds import HOMOGENISED, Kind
from excitation.plan import Test, TestPlan, config_of, plan_from_config
from excitation.plan_files import holds_a_plan
from excitation.prediction import ForceModel
from excitation.signal import JSON, Excitation
from excitation.synthesis import excitation_from_config

__all__ = ["COMMANDS", "design", "design_file", "envelope_of", "remake", "remake_file", "within_envelope"]

COMMANDS = ("random-phase", "homogenised", "harmonic")


def design_file(
    command: str,
    path: Path | str,
    *,
    envelope: Envelope | Path | str | None = None,
    fit: bool = False,
    force_model: ForceModel | None = None,
) -> Excitation | TestPlan:
    """What `damper-rig design COMMAND CONFIG.toml` makes, checked against the limits or scaled to fit them.

    ``envelope`` (or its TOML file) replaces the one that the configuration names. Paths in the configuration (an
    envelope, a service record) are relative to the configuration file.

    Raises DesignError or EnvelopeError that begins with the file's name.
    """
    path = Path(path)
    config = _with_paths_resolved(read_config(path), path.parent)
    try:
        limits = envelope if isinstance(envelope, Envelope) else None if envelope is None else read_envelope(envelope)
        limits = limits or _limits(config)
        if limits is None or force_model is None:
            own = {} if limits is None else {"envelope": to_config(limits)}
            return design(command, config | own | ({"scale_to_fit": True} if fit else {}))
        made = design(command, {key: value for key, value in config.items() if key != "envelope"})
        fit = fit or config.get("scale_to_fit") is True
        return within_envelope(made, limits, fit=fit, force_model=force_model)
    except DesignError as error:
        raise DesignError(f"{path}: {error}") from error
    except EnvelopeError as error:
        raise EnvelopeError(f"{path}: {error}") from error


def envelope_of(path: Path | str) -> Envelope | None:
    """The envelope that a configuration file names; None where it names none. Raises DesignError."""
    path = Path(path)
    return _limits(_with_paths_resolved(read_config(path), path.parent))


def _limits(config: Mapping[str, JSON]) -> Envelope | None:
    envelope = config.get("envelope")
    return None if envelope is None else to_spec(Envelope, envelope, "envelope")  # type: ignore[arg-type]


def _with_paths_resolved(config: Mapping[str, JSON], folder: Path) -> dict[str, JSON]:
    """The configuration with its envelope read and its service record's path resolved."""
    resolved = dict(config)
    if isinstance(named := config.get("envelope"), str):
        resolved["envelope"] = read_config(folder / named)
    displacement = config.get("displacement")
    spectrum = displacement.get("spectrum") if isinstance(displacement, Mapping) else None
    if isinstance(displacement, Mapping) and isinstance(spectrum, Mapping):
        record = spectrum.get("record")
        if isinstance(record, str) and "frequency" not in spectrum:
            resolved["displacement"] = {**displacement, "spectrum": {**spectrum, "record": str(folder / record)}}
    return resolved


def within_envelope(
    made: Excitation | TestPlan,
    envelope: Envelope,
    *,
    fit: bool = False,
    force_model: ForceModel | None = None,
) -> Excitation | TestPlan:
    """What was made, if the rig can play it, or, with ``fit``, scaled so that it can.

    The force is that of ``force_model``, else of the envelope's specimen. Raises EnvelopeError.
    """
    plan = made if isinstance(made, TestPlan) else TestPlan(tests=(Test(name="excitation", excitation=made),))
    warm_up = plan.warm_up
    if fit:
        tests = tuple(scale_to_fit(test, envelope, force_model) for test in plan.tests)
        warm_up = None if warm_up is None else scale_to_fit(warm_up, envelope, force_model)
        plan = replace(plan, tests=tests, warm_up=warm_up)
    check_plan(plan, envelope, force_model)
    if warm_up is not None:
        check(warm_up, envelope, force_model)
    return plan if isinstance(made, TestPlan) else plan.tests[0].excitation


def design(command: str, config: Mapping[str, JSON]) -> Excitation | TestPlan:
    """An excitation, or a plan where the configuration asks for several levels or realisations or is
    harmonic.

    A key `envelope` (a table) is checked, with `scale_to_fit` = true the tests are scaled to it.

    Raises DesignError or EnvelopeError, one line.
    """
    check_one_of("command", command, COMMANDS)
    if command == "harmonic":
        return harmonic_plan(config)
    kind = str(Kind.MULTISINE) if command == "random-phase" else HOMOGENISED
    own = {key: value for key, value in config.items() if key not in _KEYS_OF_THE_SERIES}
    made = _one_or_series({**own, "kind": kind}, config)
    envelope, fit = config.get("envelope"), config.get("scale_to_fit", False)
    if not isinstance(fit, bool):
        raise DesignError(f"scale_to_fit is {fit!r}: it must be true or false")
    if envelope is None:
        return made
    return within_envelope(made, to_spec(Envelope, envelope, "envelope"), fit=fit)  # type: ignore[arg-type]


# keys of the configuration that do not belong to the multisine
_KEYS_OF_THE_SERIES = frozenset({"levels", "realisations", "kind", "envelope", "scale_to_fit"})


def _one_or_series(own: Mapping[str, JSON], config: Mapping[str, JSON]) -> Excitation | TestPlan:
    levels, realisations = config.get("levels", [own.get("level", 1.0)]), config.get("realisations", 1)
    if not isinstance(levels, (list, tuple)) or not levels:
        raise DesignError(f"levels is {levels!r}: give a list of shares of the full displacement, above 0, up to 1")
    if type(realisations) is not int or not 1 <= realisations <= 1000:
        raise DesignError(f"realisations is {realisations!r}: it must lie in 1 … 1000")
    if "levels" not in config and realisations == 1:
        return excitation_from_config(own)
    return _series(own, list(levels), realisations)


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


def remake_file(path: Path | str) -> Excitation | TestPlan:
    """What is in an excitation or plan file, made again from the designs that it carries: the same bytes.

    Raises ExcitationFileError or DesignError, one line.
    """
    path = Path(path)
    if not holds_a_plan(path):
        return remake(read_excitation(path))
    plan = read_plan(path)
    config: dict[str, JSON] = {"tests": [config_of(test) for test in plan.tests]}
    if plan.warm_up is not None:
        config["warm_up"] = config_of(plan.warm_up)
    return plan_from_config(config)
