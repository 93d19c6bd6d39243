"""``damper-rig identify``: a black box from measured runs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from identification.blackbox import Base, Identified, Structure
    from rigctl.runfile import Run

__all__ = ["identify"]


def identify(
    kind: Annotated[str, typer.Argument(metavar="KIND", help="nnoe, narx, mlp, arx, polynomial or hybrid.")],
    runs: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Measured runs of one specimen.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="MODEL.json", help="The identified model.")],
    held_out: Annotated[
        list[Path] | None,
        typer.Option("--held-out", metavar="RUN.h5 ...", help="Runs that are only simulated and compared."),
    ] = None,
    regressors: Annotated[
        list[str] | None,
        typer.Option("--regressors", metavar="'F1 v0 v1 …'", help="Delayed signals, in place of a choice of them."),
    ] = None,
    nodes: Annotated[int | None, typer.Option("--nodes", help="Nodes of the hidden layer, with --regressors.")] = None,
    rate: Annotated[
        float | None, typer.Option("--rate", metavar="HZ", help="Resample all runs to this rate first.")
    ] = None,
    base: Annotated[
        Path | None,
        typer.Option(
            "--base", metavar="MODEL.json", help="Physical model under a hybrid; default: a simple one, fitted."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
) -> None:
    """Identify a black box from runs: structure and weight decay are chosen by cross-validation.

    Example: damper-rig identify nnoe runs/*.h5 --held-out other/*.h5 -o network.json
    """
    from api.cli.terminal import answer, progress_bar, warn
    from identification.blackbox import identify as identified
    from identification.blackbox import write_identified
    from identification.compute import chosen
    from identification.measured import read_runs

    structures = _structures(kind, regressors, nodes)
    every = read_runs([*runs, *(held_out or [])], once=True)
    measured, shown = every[: len(runs)], every[len(runs) :]
    warn([*measured, *shown])
    with chosen(os.environ), progress_bar("identifying") as tell:
        result = identified(
            kind,
            measured,
            held_out=shown,
            name=output.stem,
            structures=structures,
            rate_hz=rate,
            base=_base(kind, base, measured),
            tell=tell,
        )
    write_identified(output, result.model)
    answer(_text(output, result), _figures(output, result), as_json=as_json)


def _base(kind: str, given: Path | None, runs: list[Run]) -> Base | None:
    """What a hybrid builds on."""
    from api.errors import InputError
    from identification.blackbox import Base
    from identification.fitting import simple_base
    from identification.physical.modelfile import model_to_json, read_model

    if kind != "hybrid":
        if given is not None:
            raise InputError("--base is for a hybrid only")
        return None
    model = simple_base(runs) if given is None else read_model(given)
    return Base(model, model_to_json(model))


def _structures(kind: str, given: list[str] | None, nodes: int | None) -> list[Structure]:
    """The structures that the user asks for; none: those that the kind tries."""
    from api.errors import InputError
    from identification.blackbox import KINDS, RECIPES, Structure
    from identification.blackbox import regressors as named

    if kind not in KINDS:
        raise InputError(f"KIND is '{kind}': use {', '.join(KINDS)}")
    if nodes is not None and not given:
        raise InputError("--nodes needs --regressors")
    if kind not in RECIPES:
        return [Structure(named(text), 0) for text in given or []]
    count = RECIPES[kind].nodes if nodes is None else nodes
    return [Structure(named(text), count) for text in given or []]


def _figures(output: Path, result: Identified) -> dict[str, Any]:  # Any: JSON
    return {
        "file": str(output),
        "fit_predicted": result.predicted,
        "fit_trained": result.trained,
        "fit_held_out": dict(result.shown),
        "share_of_base": result.model.facts.get("share_of_base"),
        "stable": result.stable,
        "memory_s": result.memory_s if result.stable else None,
        "weights": len(result.model.names()),
        "candidates": [
            {
                "regressors": [str(one) for one in judged.candidate.structure.regressors],
                "candidate": str(judged.candidate),
                "fit": judged.fit,
            }
            for judged in result.judged
        ],
    }


def _text(output: Path, result: Identified) -> str:
    model = result.model
    lines = [
        f"{output}: fit in free run {result.predicted:.2f} % by cross-validation, {result.trained:.2f} % in training",
        f"  {result.judged[0].candidate}; {len(model.names())} parameters",
    ]
    if "share_of_base" in model.facts:
        lines.append(
            f"  the base alone explains {100.0 * model.facts['share_of_base']:.1f} % of the variance of the force"
        )
    lines += [f"  held out {name}: fit {fit:.2f} %" for name, fit in result.shown.items()]
    forgets = f"forgets its start within {result.memory_s:.2g} s" if result.stable else "never forgets its start"
    return "\n".join([*lines, f"  a free run {forgets}"])
