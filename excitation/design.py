"""One call for each `damper-rig design` command: from a configuration to an excitation or a plan."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from excitation.checks import check_one_of
from excitation.configuration import read_config, to_config, to_spec
from excitation.envelope import Envelope, read_envelope
from excitation.errors import DesignError, EnvelopeError
from excitation.excess import ON_EXCESS, OnExcess, fit_plan
from excitation.files import read_excitation, read_plan
from excitation.harmonic_plan import harmonic_plan
from excitation.joined_plan import joined_plan
from excitation.kinds import HOMOGENISED, NOISE, REPLAY, Kind
from excitation.plan import Test, TestPlan, config_of, plan_from_config
from excitation.plan_files import holds_a_plan
from excitation.prediction import ForceModel
from excitation.presets import PresetSpec, harmonic_config
from excitation.series import one_or_series
from excitation.signal import JSON, Excitation
from excitation.synthesis import excitation_from_config, extreme_of

__all__ = ["COMMANDS", "design", "design_file", "envelope_of", "remake", "remake_file", "within_envelope"]

_KINDS: Mapping[str, str] = {  # commands that make one excitation, or one at several levels, and its kind
    "random-phase": str(Kind.MULTISINE),
    "homogenised": HOMOGENISED,
    "steps": str(Kind.STEPS),
    "sweep": str(Kind.SWEEP),
    "noise": NOISE,
    "road": str(Kind.ROAD),
    "replay": REPLAY,
}
COMMANDS = (*_KINDS, "harmonic", "preset", "plan")


def design_file(
    command: str,
    path: Path | str,
    *,
    envelope: Envelope | Path | str | None = None,
    fit: bool = False,
    on_excess: OnExcess | None = None,
    force_model: ForceModel | None = None,
) -> Excitation | TestPlan:
    """What `damper-rig design COMMAND CONFIG.toml` makes, checked against the limits or scaled to fit them.

    ``envelope`` (or its TOML file) replaces the one that the configuration names; ``on_excess`` says what becomes of
    tests that exceed it, ``fit`` is "scale". Paths in the configuration (an
    envelope, a service record) are relative to the configuration file.

    Raises DesignError or EnvelopeError that begins with the file's name.
    """
    path = Path(path)
    config = _with_paths_resolved(read_config(path), path.parent)
    try:
        limits = envelope if isinstance(envelope, Envelope) else None if envelope is None else read_envelope(envelope)
        limits = limits or _limits(config)
        given: OnExcess | None = on_excess or ("scale" if fit else None)
        own: dict[str, JSON] = {} if given is None else {"on_excess": given}
        if limits is None or force_model is None:
            return design(command, config | own | ({} if limits is None else {"envelope": to_config(limits)}))
        how = _on_excess({**config, **own})
        made = design(command, {key: value for key, value in config.items() if key != "envelope"})
        return within_envelope(made, limits, on_excess=how, force_model=force_model)
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
    """The configuration with its envelope read and the paths of records and parts resolved."""
    resolved = dict(config)
    if isinstance(named := config.get("envelope"), str):
        resolved["envelope"] = read_config(folder / named)
    if isinstance(record := config.get("record"), str):
        resolved["record"] = str(folder.resolve() / record)
    if isinstance(parts := config.get("parts"), (list, tuple)):
        resolved["parts"] = [_part_resolved(part, folder) for part in parts]
    displacement = config.get("displacement")
    spectrum = displacement.get("spectrum") if isinstance(displacement, Mapping) else None
    if isinstance(displacement, Mapping) and isinstance(spectrum, Mapping):
        record = spectrum.get("record")
        if isinstance(record, str) and "frequency" not in spectrum:
            resolved["displacement"] = {**displacement, "spectrum": {**spectrum, "record": str(folder / record)}}
    return resolved


def _part_resolved(part: JSON, folder: Path) -> JSON:
    if not isinstance(part, Mapping):
        return part
    paths = {key: str(folder / name) for key in ("file", "config") if isinstance(name := part.get(key), str) and name}
    test = part.get("test")
    if isinstance(test, Mapping) and isinstance(record := test.get("record"), str):
        return {**part, **paths, "test": {**test, "record": str(folder.resolve() / record)}}
    return {**part, **paths}


def within_envelope(
    made: Excitation | TestPlan,
    envelope: Envelope,
    *,
    fit: bool = False,
    on_excess: OnExcess | None = None,
    force_model: ForceModel | None = None,
) -> Excitation | TestPlan:
    """What was made, if the rig can play it, or what ``on_excess`` makes of it so that it can; ``fit`` is "scale". What
    became of an excitation is its figure ``changes``, of a plan its ``changes``.

    The force is that of ``force_model``, else of the envelope's specimen. Raises EnvelopeError.
    """
    plan = made if isinstance(made, TestPlan) else TestPlan(tests=(Test(name="excitation", excitation=made),))
    plan = fit_plan(plan, envelope, on_excess or ("scale" if fit else "refuse"), force_model)
    if isinstance(made, TestPlan):
        return plan
    fitted = plan.tests[0].excitation
    return fitted.with_figures({"changes": list(plan.changes)}) if plan.changes else fitted


def design(command: str, config: Mapping[str, JSON]) -> Excitation | TestPlan:
    """An excitation, or a plan where the configuration asks for several levels or realisations or for many tests.

    A key `envelope` (a table) is checked; `on_excess` says what becomes of tests that exceed it, `scale_to_fit` = true
    is "scale".

    Raises DesignError or EnvelopeError, one line.
    """
    check_one_of("command", command, COMMANDS)
    how = _on_excess(config)
    envelope = config.get("envelope")
    try:
        made = _designed(command, {key: value for key, value in config.items() if key not in _KEYS_OF_THE_RIG})
    except ArithmeticError as error:
        raise DesignError(f"a value is too large or too small to compute with: {extreme_of(config)}") from error
    if envelope is None:
        return made
    return within_envelope(made, to_spec(Envelope, envelope, "envelope"), on_excess=how)  # type: ignore[arg-type]


def _on_excess(config: Mapping[str, JSON]) -> OnExcess:
    """What the configuration asks for; raises DesignError."""
    fit = config.get("scale_to_fit", False)
    if not isinstance(fit, bool):
        raise DesignError(f"scale_to_fit is {fit!r}: it must be true or false")
    how = config.get("on_excess", "scale" if fit else "refuse")
    check_one_of("on_excess", how, ON_EXCESS)
    return how  # type: ignore[return-value]  # one of them


def _designed(command: str, config: Mapping[str, JSON]) -> Excitation | TestPlan:
    match command:
        case "harmonic":
            return harmonic_plan(config)
        case "preset":
            return harmonic_plan(harmonic_config(to_spec(PresetSpec, config)))
        case "plan":
            return joined_plan(config, design_file)
        case "random-phase" | "homogenised":
            return one_or_series(_KINDS[command], config)
    return excitation_from_config({**config, "kind": _KINDS[command]})


_KEYS_OF_THE_RIG = frozenset({"envelope", "scale_to_fit", "on_excess"})  # they do not belong to the signal


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
