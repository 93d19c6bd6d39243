"""The page of an analysis, one file that opens offline."""

from __future__ import annotations

import html
from collections.abc import Iterator, Sequence
from pathlib import Path

from excitation.analysis import Analysis, Level
from excitation.atomic import written_whole
from identification.analysis.charts import charts, over_levels, own_charts, responses
from identification.analysis.levels import AtLevel, LevelsFound
from identification.analysis.words import analysis_text, linear_share, refused_text
from identification.errors import OutputError
from identification.page_style import ON_PAPER, document, drawn, table

__all__ = ["analysis_html", "write_analysis"]

_NOTES = """Linear: the part of the force that the best linear approximation makes of motion and current at this level
and spectrum. Odd distortion: what a symmetrical curve adds (the same in rebound and compression: friction, a degressive
valve). Even distortion: what differs between rebound and compression, and products of motion and current. Noise: what
differs from period to period, of one period. Change: what drifts from period to period, as warming does. Each is rms
over the lines up to five times the highest driven one; bounds hold the value with 95 %. Levels are those of these runs:
another realisation of the same design has another peak and so another distortion. The band of the approximation
includes distortion and noise; at another level the approximation is another one."""


_MOST_DRAWN = 12  # levels with charts of their own: each takes a browser a tenth of a second and 100 kB


def write_analysis(path: Path, found: LevelsFound) -> None:
    """Write the page, whole or not at all. Raises OutputError."""
    with written_whole(path, OutputError) as temporary:
        temporary.write_text(analysis_html(found), encoding="utf-8")


def analysis_html(found: LevelsFound) -> str:
    """The whole page: one level with all its charts; several drawn together, and each by itself."""
    parts = _parts(found.levels[0].found) if found.alone else _parts_of_all(found)
    return document("Linear part, distortion and noise", parts)


def _parts_of_all(every: LevelsFound) -> Iterator[str]:
    levels = every.levels
    yield "<h1>Linear part, distortion and noise at several levels</h1>"
    yield f"<p>{len(levels)} designs and levels, each with an approximation of its own.</p>"
    if every.refused:
        lines = "".join(f"<li>{html.escape(refused_text(one))}</li>" for one in every.refused)
        yield f"<ul>{lines}</ul>"
    yield _overview(levels)
    yield f"<p class=note>{_NOTES}</p>"
    named = [(one.setting.text, one.found) for one in levels]
    yield drawn(over_levels(named), first=True)
    for over in ("velocity", "displacement", "current"):
        known = [
            (f"{number}: {name}", one)
            for number, (name, found) in enumerate(named, start=1)
            for one in found.responses
            if one.over == over
        ]
        if known:
            yield drawn(responses(known), first=False)
    for number, one in enumerate(levels, start=1):
        yield f"<h2>Level {number}: {html.escape(one.setting.text)}</h2>{_told(one.found)}{_levels(one.found)}"
        if number <= _MOST_DRAWN:
            yield from (drawn(figure, first=False) for figure in own_charts(one.found))
        yield _runs(one.found)
    if len(levels) > _MOST_DRAWN:
        yield f"<p class=note>Beyond {_MOST_DRAWN} levels there are tables only: analyse fewer for their spectra.</p>"
    yield ON_PAPER


def _overview(levels: Sequence[AtLevel]) -> str:
    heads = ("level", "motion, current", "force, N rms", "linear, % of the power", "odd, N", "even, N", "noise, N")
    rows = [
        (
            str(number),
            html.escape(one.setting.text),
            f"{one.found.levels.force_rms:.4g}",
            f"{linear_share(one.found):.3f}",
            *(_short(level) for level in (one.found.levels.odd, one.found.levels.even, one.found.levels.noise)),
        )
        for number, one in enumerate(levels, start=1)
    ]
    return table(f"<tr>{''.join(f'<th>{head}</th>' for head in heads)}</tr>", rows)


def _short(level: Level | None) -> str:
    if level is None:
        return "–"
    return f"{level.rms:.3g}" if level.is_seen else f"&lt; {level.bounds[1]:.3g}"


def _told(found: Analysis) -> str:
    first, *_ = analysis_text(found).splitlines()
    notes = "".join(f"<li>{html.escape(note)}</li>" for note in found.notes)
    return f"<p>{html.escape(first)}.</p>" + (f"<ul>{notes}</ul>" if notes else "")


def _parts(found: Analysis) -> Iterator[str]:
    yield f"<h1>Linear part, distortion and noise of a periodic test</h1>{_told(found)}"
    yield f"<h2>Parts of the force</h2>{_levels(found)}<p class=note>{_NOTES}</p>"
    for number, figure in enumerate(charts(found)):
        yield drawn(figure, first=number == 0)
    yield f"<h2>Runs</h2>{_runs(found)}"
    yield ON_PAPER


def _levels(found: Analysis) -> str:
    levels = found.levels
    rows = [f"<tr><td>whole force</td><td>{levels.force_rms:.4g}</td><td></td><td>100</td><td></td></tr>"]
    rows.append(
        f"<tr><td>linear</td><td>{levels.linear_rms:.4g}</td><td></td>"
        f"<td>{_share(levels.linear_rms, levels.force_rms)}</td><td>{linear_share(found):.3f}</td></tr>"
    )
    named = [
        ("odd distortion", levels.odd),
        ("even distortion", levels.even),
        ("odd and even distortion together", levels.nonlinear),
        (f"noise of one period, up to {found.reach_hz:.3g} Hz", levels.noise),
        ("change from period to period", found.variation.level),
    ]
    rows += [_row(name, level, levels.force_rms) for name, level in named]
    heads = "".join(f"<th>{h}</th>" for h in ("", "N rms", "95 % bounds, N", "% of the rms force", "% of its power"))
    return f'<div class="wide"><table><thead><tr>{heads}</tr></thead><tbody>{"".join(rows)}</tbody></table></div>'


def _row(name: str, level: Level | None, force: float) -> str:
    if level is None:
        return f"<tr><td>{name}</td><td colspan=4>not known from these runs</td></tr>"
    low, high = level.bounds
    value = f"{level.rms:.3g}" if level.is_seen else f"&lt; {high:.3g}"
    power = 100.0 * max(level.power, 0.0) / force**2 if force else 0.0
    return (
        f"<tr><td>{name}</td><td>{value}</td><td>{low:.3g} … {high:.3g}</td>"
        f"<td>{_share(level.rms if level.is_seen else high, force)}</td><td>{power:.3g}</td></tr>"
    )


def _share(part: float, force: float) -> str:
    return f"{100.0 * part / force:.3g}" if force else "–"


def _runs(found: Analysis) -> str:
    rows = "".join(
        f"<tr><td>{html.escape(', '.join((one.name, *one.also)))}</td>"
        f"<td>{one.periods}</td><td>{one.left_out}</td></tr>"
        for one in found.played
    )
    heads = "<tr><th>run</th><th>periods used</th><th>leading periods left out, not settled</th></tr>"
    return f'<div class="wide"><table><thead>{heads}</thead><tbody>{rows}</tbody></table></div>'
