"""The sheet as one HTML page that opens offline."""

from __future__ import annotations

import html
from collections.abc import Iterator, Sequence
from pathlib import Path

from excitation.atomic import written_whole
from identification.errors import OutputError
from identification.force_velocity import Side, at_peak_speed, hysteresis_widths
from identification.page_style import document, plots, table
from identification.sheet.charts import charts
from identification.sheet.results import AtCurrent, Sheet, SineTest
from identification.static_force import Estimate
from identification.steady import dynamic_stiffness, energy_per_cycle, loop_shape, loss_factor

_SIGNS = Path(__file__).parents[1] / "signs.svg"  # the convention, as the README shows it


def write_sheet(path: Path, sheet: Sheet) -> None:
    """Write the page, whole or not at all. Raises OutputError."""
    with written_whole(path, OutputError) as temporary:
        temporary.write_text(html_of(sheet), encoding="utf-8")


def html_of(sheet: Sheet) -> str:
    """The whole page."""
    return document("Damper characteristics", _parts(sheet))


def _parts(sheet: Sheet) -> Iterator[str]:
    title = f": {html.escape(sheet.specimen)}" if sheet.specimen else ""
    yield f"<h1>Damper characteristics{title}</h1>"
    yield f'<div class="signs">{_SIGNS.read_text(encoding="utf-8")}</div>'
    yield "<h2>At rest</h2>" + table(_AT_REST, map(_rest_cells, sheet.currents))
    yield f"<p class=note>{_ON_REST}</p>"
    yield "<h2>Curve of each side</h2>" + table(_CURVES, map(_curve_cells, sheet.currents))
    yield f"<p class=note>{_ON_CURVES}</p>"
    yield "<h2>Tests: rebound and compression at peak speed</h2>" + table(_PEAKS, map(_peak_cells, sheet.tests))
    yield "<h2>Tests: whole cycles</h2>" + table(_WHOLE, map(_whole_cells, sheet.tests))
    yield f"<p class=note>{_ON_THE_CYCLES}</p>"
    if sheet.left_out:
        yield f"<p class=note>Left out, no steady sine or no force: {html.escape(', '.join(sheet.left_out))}.</p>"
    yield "<ul>" + "".join(f"<li>{html.escape(text)}</li>" for text in sheet.findings) + "</ul>"
    yield from plots(charts(sheet))


def _head(*groups: tuple[str, Sequence[str]]) -> str:
    """Two rows: the groups, and the columns of each."""
    over = "".join(f"<th colspan={len(names)}>{group}</th>" for group, names in groups)
    return f"<tr>{over}</tr><tr>{''.join(f'<th>{name}</th>' for _, names in groups for name in names)}</tr>"


_SIDE = ("slope at rest, N·s/m", "knee, m/s", "slope beyond, N·s/m")
_AT_REST = _head(("", ("current, A", "gas force, N", "its stiffness, N/m", "friction, N", "speed of the tests, m/s")))
_CURVES = _head(("", ("current, A",)), ("rebound", _SIDE), ("compression", _SIDE), ("", ("rms of the rest, N",)))
_ON_REST = (
    "Gas force: the force at rest, at mid stroke, that pushes the rod out; an offset of the load cell is part of it. "
    "It, its stiffness and the friction are read from the slowest strokes and extrapolated to speed zero: what "
    "saturates below their speed counts as friction. ± is one standard deviation; it includes how far the "
    "answer depends on the extrapolation."
)
_ON_CURVES = (
    "F = F<sub>0</sub> ± F<sub>c</sub> + v·(c<sub>far</sub> + (c − c<sub>far</sub>)/√(1 + (v/w)²)) through the forces "
    "at peak speed, each side by itself: F<sub>0</sub> and the friction F<sub>c</sub> as above, slope at rest c, "
    "knee w, slope beyond c<sub>far</sub>. From four speeds on. A value in brackets is not determined by "
    "these speeds: its standard deviation is larger than itself."
)
_ON_THE_CYCLES = (
    "Hysteresis width: greatest difference of force between speeding up and slowing down on that side. Loop shape: 1 "
    "is an ellipse, 1.27 a rectangle (dry friction), below 1 a peaked loop. Loops are drawn from up to 25 harmonics of "
    "the steady cycles."
)


def _at(current: float | None) -> str:
    return "–" if current is None else f"{current:g}"


def _rest_cells(group: AtCurrent) -> list[str]:
    rest = group.at_rest
    gas = Estimate(-rest.force.value, rest.force.std)
    speeds = dict.fromkeys(f"{speed:.2g}" for speed in (rest.slowest_m_s, rest.fastest_m_s))
    return [_at(group.current), str(gas), str(rest.stiffness), str(rest.friction), " – ".join(speeds)]


def _curve_cells(group: AtCurrent) -> list[str]:
    curve = group.curve
    if curve is None:
        return [_at(group.current), *["–"] * 7]
    return [_at(group.current), *_side(curve.rebound), *_side(curve.compression), _short(curve.rms)]


def _side(side: Side) -> list[str]:
    values = zip((side.c, side.w_knee, side.c_far), side.std, strict=True)
    return [str(Estimate(value, std)) if std < abs(value) else f"({_short(value)})" for value, std in values]


def _short(value: float) -> str:
    """Three digits, never with an exponent where there are few before the point."""
    return f"{value:.3g}" if abs(value) < 999.5 else f"{value:.0f}"


_TEST = ("run", "amplitude, mm", "frequency, Hz", "current, A")
_PEAK = ("speed, m/s", "force, N", "hysteresis width, N")
_PEAKS = _head(("", _TEST), ("rebound", _PEAK), ("compression", _PEAK))
_WHOLE = _head(
    ("", _TEST),
    ("", ("measured amplitude, mm", "energy per cycle, J", "stiffness, kN/m", "loss factor", "loop shape")),
    ("temperature, °C", ("start", "end")),
)


def _named(test: SineTest) -> list[str]:
    asked = f"{1e3 * test.amplitude_asked:g}", f"{test.frequency_asked:g}", _at(test.current_asked)
    return [html.escape(test.cycles.name), *asked]


def _peak_cells(test: SineTest) -> list[str]:
    speeds, forces = at_peak_speed([test.cycles])
    each = zip(speeds, forces, hysteresis_widths(test.cycles), strict=True)
    return _named(test) + [cell for v, force, width in each for cell in (f"{v:.3g}", f"{force:.1f}", _short(width))]


def _whole_cells(test: SineTest) -> list[str]:
    cycles = test.cycles
    degc = ["–", "–"] if test.temperature is None else [f"{value:.1f}" for value in test.temperature]
    return [
        *_named(test), f"{1e3 * cycles.amplitude_m:.4g}", f"{energy_per_cycle(cycles):.4g}",
        f"{dynamic_stiffness(cycles) / 1e3:.4g}", _loss(loss_factor(cycles)), f"{loop_shape(cycles):.3f}", *degc,
    ]  # fmt: skip


def _loss(value: float) -> str:
    """The loss factor; beyond 100 the stored part is noise, and so is its sign."""
    return f"{value:.3g}" if abs(value) <= 100.0 else "above 100"
