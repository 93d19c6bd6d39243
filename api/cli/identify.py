"""``damper-rig identify``: a black box from measured runs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from api.cli.places import spare_runs, to_file

if TYPE_CHECKING:
    from identification.blackbox import Identified, Search

__all__ = ["identify"]


def identify(
    kind: Annotated[
        str, typer.Argument(metavar="KIND", help="nnoe, narx, mlp, arx, polynomial, hybrid, inverse or multiaxis.")
    ],
    runs: Annotated[list[Path], typer.Argument(metavar="RUN.h5 ...", help="Measured runs of one specimen.")],
    output: Annotated[
        Path, typer.Option("-o", "--output", callback=to_file, metavar="MODEL.json", help="The identified model.")
    ],
    held_out: Annotated[
        list[Path] | None,
        typer.Option("--held-out", metavar="RUN.h5 ...", help="Runs that are only simulated and compared."),
    ] = None,
    regressors: Annotated[
        list[str] | None,
        typer.Option("--regressors", metavar="'F1 v0 v1 …'", help="Delayed signals, in place of a choice of them."),
    ] = None,
    nodes: Annotated[int | None, typer.Option("--nodes", help="Nodes of the hidden layer, with --regressors.")] = None,
    layers: Annotated[
        str | None,
        typer.Option("--layers", metavar="14,8", help="narx, mlp: nodes of each hidden layer, one to three."),
    ] = None,
    activation: Annotated[
        str | None,
        typer.Option("--activation", help="narx, mlp: of the hidden layers: logsig, purelin, tansig, satlins, radbas."),
    ] = None,
    evolve: Annotated[
        bool,
        typer.Option("--evolve", help="narx, mlp: differential evolution of activations and weights before training."),
    ] = False,
    rate: Annotated[
        float | None, typer.Option("--rate", metavar="HZ", help="Resample all runs to this rate first.")
    ] = None,
    base: Annotated[
        Path | None,
        typer.Option(
            "--base",
            metavar="MODEL.json",
            help="Physical model under a hybrid, default: a simple one, fitted; "
            "forward model of an inverse, default: nnoe; of the main axis of several, default: a simple one, fitted.",
        ),
    ] = None,
    select: Annotated[
        bool, typer.Option("--select", help="Search the regressors first: add the best, drop what is not needed.")
    ] = False,
    every: Annotated[
        bool, typer.Option("--every", help="With --select: train every structure, not the most promising only.")
    ] = False,
    longest: Annotated[
        int | None, typer.Option("--longest", metavar="SAMPLES", help="With --select: longest delay; default 5.")
    ] = None,
    search: Annotated[
        Path | None,
        typer.Option(
            "--search",
            callback=to_file,
            metavar="SEARCH.json",
            help="With --select: its state, to go on after an interruption.",
        ),
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option(
            "--page", callback=to_file, metavar="PAGE.html", help="With --select: the path of the search, drawn."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
) -> None:
    """Identify a black box from runs: structure and weight decay are chosen by cross-validation.

    Example: damper-rig identify nnoe runs/*.h5 --held-out other/*.h5 -o network.json

    Tests of single axes of a rig of six: damper-rig identify multiaxis x.h5 y.h5 z.h5 -o six.json

    With a search for regressors: damper-rig identify nnoe runs/*.h5 --select --page search.html -o network.json
    """
    from api.cli.regressor_search import SHARE, offer_of, searched
    from api.cli.terminal import progress_bar, warn
    from identification.blackbox import identify as identified
    from identification.blackbox import layers_asked, structures_asked
    from identification.compute import chosen
    from identification.fitting.hybrid_base import base_asked, check_asked
    from identification.measured import read_runs
    from identification.physical.modelfile import read_model

    spare_runs(output, [*runs, *(held_out or [])])
    if kind == "inverse":
        from api.cli.identify_inverse import identify_inverse, refuse_select

        refuse_select(select or every or longest is not None or search is not None or page is not None)
        layers_asked(kind, layers, activation, evolved=evolve, nodes=nodes)
        identify_inverse(runs, held_out or [], output, regressors or [], nodes, rate, base, as_json=as_json)
        return
    if kind == "multiaxis":
        from api.cli.identify_axes import identify_axes, refuse_structure

        refuse_structure(regressors or evolve or select or every)
        refuse_structure(any(one is not None for one in (nodes, layers, activation, longest, search, page)))
        identify_axes(runs, held_out or [], output, rate, base, as_json=as_json)
        return
    structures = structures_asked(kind, regressors or (), nodes, searched=select)
    shape = layers_asked(kind, layers, activation, evolved=evolve, nodes=nodes, searched=select)
    below = None if base is None else read_model(base)
    asked = offer_of(
        select=select, every=every, longest=longest, nodes=nodes, regressors=regressors, files=(search, page)
    )
    read = read_runs([*runs, *(held_out or [])], once=True)
    measured, shown = read[: len(runs)], read[len(runs) :]
    if asked is not None or kind == "hybrid":  # what others refuse, they refuse at once
        check_asked(kind, measured, shown, structures=structures, rate_hz=rate, base=below, layers=shape)
    with chosen(os.environ), progress_bar("identifying") as tell:
        found = None if asked is None else searched(kind, measured, asked, rate, search, tell)
        begun = 0.0 if found is None else SHARE
        if kind == "hybrid":
            tell(begun, "base: its loops are compiled once for a machine")
        result = identified(
            kind,
            measured,
            held_out=shown,
            name=output.stem,
            structures=structures if found is None else [found.found.structure],
            rate_hz=rate,
            base=base_asked(kind, below, measured),
            layers=shape,
            evolved=evolve,
            tell=lambda done, text: tell(begun + (1.0 - begun) * done, text),
        )
    warn(read)  # only now: a refusal is one line
    _kept(output, result, found, page, as_json=as_json)


def _kept(output: Path, result: Identified, found: Search | None, page: Path | None, *, as_json: bool) -> None:
    """Write the model, and the page of a search, and print the figures."""
    from api.cli.terminal import answer
    from identification.blackbox import identified_data, identified_text, search_data, search_text, write_identified
    from identification.blackbox.search_page import write_search_page

    write_identified(output, result.model)
    text, figures = f"{output}: {identified_text(result)}", {"file": str(output), **identified_data(result)}
    if found is not None:
        text, figures = f"{text}\n{search_text(found)}", figures | {"search": search_data(found)}
        if page is not None:
            write_search_page(page, output.stem, found)
            text, figures = f"{text}\n{page}", figures | {"page": str(page)}
    answer(text, figures, as_json=as_json)
