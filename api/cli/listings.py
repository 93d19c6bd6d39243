"""``damper-rig elements``, ``specimens``, ``effects`` and ``faults``: what there is, read from the code."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from typing import Annotated

import typer

__all__ = ["effects", "elements", "faults", "specimens"]

AsJson = Annotated[bool, typer.Option("--json", help="Print the list as JSON.")]


def elements(
    name: Annotated[str, typer.Argument(metavar="[NAME]", help="An element; without it all, a line each.")] = "",
    as_json: AsJson = False,
) -> None:
    """What a physical model can be made of: equation, parameters with units and ranges, and what test shows them.

    Example: damper-rig elements coulomb_friction
    """
    from api.cli.terminal import answer
    from identification.physical.elements import CATALOGUE
    from identification.physical.elements.described import catalogue_text, element_data, element_text

    if name:
        spec = CATALOGUE[_known(name, CATALOGUE, "element")]
        answer(element_text(spec), element_data(spec), as_json=as_json)
        return
    answer(catalogue_text(), [element_data(spec) for spec in CATALOGUE.values()], as_json=as_json)


def specimens(as_json: AsJson = False) -> None:
    """The dampers of the simulated rig, for sim --specimen.

    Example: damper-rig specimens
    """
    from api.cli.terminal import answer
    from sim_rig.specimens import SPECIMENS

    values = [
        {
            "specimen": one.name,
            "text": one.text,
            "stroke_m": one.stroke_m,
            "speed_m_s": one.speed_m_s,
            "force_rms_n": one.force_rms_n,
            "current_a": None if one.current_a is None else list(one.current_a),
        }
        for one in SPECIMENS.values()
    ]
    rows = [
        (one.name, f"±{1e3 * one.stroke_m:g} mm, {one.speed_m_s:g} m/s, {one.force_rms_n:g} N rms", one.text)
        for one in SPECIMENS.values()
    ]
    answer(_table(rows), values, as_json=as_json)


def effects(as_json: AsJson = False) -> None:
    """What can be hidden in a specimen of the simulated rig, for sim --hide.

    Example: damper-rig effects --json
    """
    from api.cli.terminal import answer
    from sim_rig.effects import EFFECTS

    values = [
        {"effect": name, "path": one.path, "needs_current": one.needs_current, "in_catalogue": one.listed}
        for name, one in EFFECTS.items()
    ]
    rows = [
        (
            name,
            one.path,
            "; ".join(
                filter(
                    None,
                    (
                        "needs a controllable damper" * one.needs_current,
                        "outside the catalogue: no name is right for it" * (not one.listed),
                    ),
                )
            ),
        )
        for name, one in EFFECTS.items()
    ]
    answer(_table(rows), values, as_json=as_json)


def faults(as_json: AsJson = False) -> None:
    """The faults of the simulated rig, for sim --fault, and how a run ends with each.

    Example: damper-rig faults
    """
    from api.cli.terminal import answer
    from sim_rig.fault_table import FAULT_TABLE

    values = [
        {
            "fault": row.name,
            "order": row.order or None,
            "happens": row.happens,
            "rig_ends_in": row.state.name,
            "at_rest_within_s": row.within_s or None,
            "run_file": row.file,
            "operator_reads": row.reads or None,
        }
        for row in FAULT_TABLE
    ]
    rows = [(row.order or "(not by command)", row.file, f"{row.name}: {row.happens}") for row in FAULT_TABLE]
    answer(_table(rows), values, as_json=as_json)


def _known(name: str, known: Iterable[str], what: str) -> str:
    from api.errors import InputError

    names = list(known)
    if name in names:
        return name
    near = get_close_matches(name, names, n=3)
    raise InputError(f"{what} {name!r:.60} does not exist: {' or '.join(near) or f'damper-rig {what}s lists all'}")


def _table(rows: Sequence[tuple[str, ...]]) -> str:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return "\n".join("  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in rows)
