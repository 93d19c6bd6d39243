"""Checks tests against the limits of the rig: a test that exceeds them is refused, or scaled until it fits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import exp

from excitation.errors import DesignError, EnvelopeError
from excitation.plan import Test, TestPlan
from excitation.prediction import ForceModel, Prediction, predict
from excitation.rig import Envelope, read_envelope
from excitation.signal import JSON, Excitation
from excitation.synthesis import excitation_from_config

__all__ = [
    "Envelope",
    "Excess",
    "check",
    "check_plan",
    "excesses",
    "predict",
    "predict_plan",
    "read_envelope",
    "rise_after",
    "scale_to_fit",
    "temperatures",
]

_ROUNDING = 1e-9  # of a limit: error of differentiation by DFT


@dataclass(frozen=True, slots=True, kw_only=True)
class Excess:
    """One limit that a test exceeds; ``needs`` more than ``limit`` (or less, where ``below``)."""

    quantity: str
    needs: float
    limit: float
    unit: str
    below: bool = False
    scales: bool = True  # whether a smaller motion helps

    def __str__(self) -> str:
        bounded = self.needs < float("inf")
        needs = f"{self.needs:.4g} {self.unit}" if bounded else "beyond all bounds"
        side = "the least is" if self.below else "the limit is"
        share = ""
        if bounded and self.limit != 0.0:
            by = abs(self.needs - self.limit) / abs(self.limit) * 100.0
            share = f" ({by:.3g} % {'below' if self.below else 'above'})"
        return f"{self.quantity} {needs.strip()}, {side} {f'{self.limit:.4g} {self.unit}'.strip()}{share}"


def excesses(excitation: Excitation, envelope: Envelope, force_model: ForceModel | None = None) -> tuple[Excess, ...]:
    """Every limit that the excitation exceeds, the worst first."""
    found = [
        *_over_limits(predict(excitation, envelope, force_model), envelope),
        *_sample_rate(excitation, envelope),
    ]
    return tuple(sorted(found, key=lambda e: -abs(e.needs - e.limit) / max(abs(e.limit), 1e-12)))


def _over_limits(predicted: Prediction, rig: Envelope) -> Iterator[Excess]:
    moves = rig.motion
    upper: list[tuple[str, float | None, float | None, str, bool]] = [
        ("displacement", predicted.displacement_m, moves.max_displacement_m, "m", True),
        ("velocity", predicted.velocity_m_s, moves.max_velocity_m_s, "m/s", True),
        ("acceleration", predicted.acceleration_m_s2, moves.max_acceleration_m_s2, "m/s²", True),
        ("frequency", predicted.highest_frequency_hz, moves.bandwidth_hz, "Hz", False),
        ("current", predicted.highest_current_a, rig.control.max_current_a, "A", False),
    ]
    if rig.force is not None:
        upper.append(("force", predicted.force_n, rig.force.dynamic_n, "N", True))
    if rig.hydraulics is not None:
        oil = rig.hydraulics
        upper.append(("servo-valve flow share", predicted.valve_flow_share, 1.0, "", True))
        upper.append(("accumulator oil", predicted.accumulator_m3, oil.accumulator_volume_m3, "m³", True))
    if rig.temperature is not None and rig.specimen is not None:
        margin = rig.temperature.max_degc - rig.specimen.ambient_degc
        upper.append(("temperature rise", predicted.temperature_rise_k, margin, "K", True))
    for quantity, needs, limit, unit, scales in upper:
        if needs is not None and limit is not None and needs > limit + _ROUNDING * abs(limit):
            yield Excess(quantity=quantity, needs=needs, limit=limit, unit=unit, scales=scales)
    lowest, least = predicted.lowest_current_a, rig.control.min_current_a
    if lowest is not None and least is not None and lowest < least - _ROUNDING * abs(least):
        yield Excess(quantity="current", needs=lowest, limit=least, unit="A", below=True, scales=False)


def _sample_rate(excitation: Excitation, rig: Envelope) -> Iterator[Excess]:
    known, rate = rig.control.sample_rates_hz, excitation.sample_rate_hz
    if known and rate not in known:
        nearest = min(known, key=lambda r: abs(r - rate))
        yield Excess(quantity="sample rate", needs=rate, limit=nearest, unit="Hz", below=rate < nearest, scales=False)


def check(test: Test, envelope: Envelope, force_model: ForceModel | None = None) -> Prediction:
    """What the test will ask of the rig.

    Raises EnvelopeError, one line: the test, the limit, by how much, and the nearest test that fits.
    """
    found = excesses(test.excitation, envelope, force_model)
    if found:
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        fits = _advice(test, envelope, force_model)
        raise EnvelopeError(f"test {test.name!r} exceeds the rig: {found[0]}{more}; {fits}")
    return predict(test.excitation, envelope, force_model)


def _advice(test: Test, envelope: Envelope, force_model: ForceModel | None) -> str:
    try:
        fitted = scale_to_fit(test, envelope, force_model)
    except EnvelopeError:
        return "no smaller motion fits: change the frequency, the sample rate or the rig"
    before, after = test.excitation.design, fitted.excitation.design
    changed = [f"{key} = {_short(value)}" for key, value in _flat(after) if dict(_flat(before)).get(key) != value]
    slower = _slower(test, envelope, force_model)
    return f"nearest that fits: {', '.join(changed)}{slower}"


def _slower(test: Test, envelope: Envelope, force_model: ForceModel | None) -> str:
    """The highest frequency that fits at the same amplitude, where the design has one frequency."""
    design = test.excitation.design
    frequency = design.get("frequency")
    if not isinstance(frequency, float):
        return ""
    if any(e.quantity in _INDEPENDENT_OF_SPEED for e in excesses(test.excitation, envelope, force_model)):
        return ""
    # the lowest frequency at which the test has at most 2^19 samples
    played_cycles = test.excitation.duration_s * frequency
    low = max(frequency * 2.0**-12, played_cycles * test.excitation.sample_rate_hz / 2.0**19)
    high = frequency
    asked = {key: value for key, value in design.items() if key != "frequency_asked"}

    def fits(f: float) -> bool:
        return not excesses(excitation_from_config({**asked, "frequency": f}), envelope, force_model)

    if not low < high or not fits(low):
        return ""
    for _ in range(14):
        middle = (low * high) ** 0.5
        low, high = (middle, high) if fits(middle) else (low, middle)
    return f", or frequency = {_round_down(low):g}"


_INDEPENDENT_OF_SPEED = ("displacement", "current", "sample rate")


def scale_to_fit(test: Test, envelope: Envelope, force_model: ForceModel | None = None) -> Test:
    """The test with its current brought into range and its motion scaled down just until every limit holds.

    A test that fits comes back as it is. Raises EnvelopeError where no smaller motion helps.
    """
    if not excesses(test.excitation, envelope, force_model):
        return test
    try:
        design = _current_in_range(test.excitation.design, envelope)
        excitation = excitation_from_config(design) if design != test.excitation.design else test.excitation
        factor = _largest_factor(excitation, envelope, force_model)
        if factor < 1.0:
            excitation = _rounded(excitation, factor, envelope, force_model)
    except DesignError as error:
        raise EnvelopeError(f"test {test.name!r} cannot be scaled to fit: {error}") from error
    left = excesses(excitation, envelope, force_model)
    if left:
        raise EnvelopeError(f"test {test.name!r} cannot be scaled to fit: {left[0]}")
    return replace(test, excitation=excitation)


def _largest_factor(excitation: Excitation, envelope: Envelope, force_model: ForceModel | None) -> float:
    """The largest factor on the displacement, by bisection, at which no limit that scales is exceeded."""

    excitation = excitation.held()

    def fits(factor: float) -> bool:
        smaller = replace(excitation, displacement_m=excitation.displacement_m * factor)
        return not any(e.scales for e in excesses(smaller, envelope, force_model))

    if fits(1.0):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(24):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    if low == 0.0:
        raise DesignError("even a motion of almost zero amplitude exceeds a limit")
    return low


def _rounded(excitation: Excitation, factor: float, envelope: Envelope, force_model: ForceModel | None) -> Excitation:
    """The design made again with an amplitude of four digits: the one nearest to the factor, or the next below it
    where that exceeds a limit.
    """
    nearest = excitation_from_config(_scaled(excitation.design, factor, down=False))
    if not any(e.scales for e in excesses(nearest, envelope, force_model)):
        return nearest
    return excitation_from_config(_scaled(excitation.design, factor, down=True))


def _scaled(design: Mapping[str, JSON], factor: float, *, down: bool) -> dict[str, JSON]:
    key = "level" if "level" in design else "amplitude"
    value = design.get(key)
    if not isinstance(value, (int, float)):
        raise DesignError("it has no design that could be scaled: only samples")
    return {**design, key: _round_down(value * factor) if down else float(f"{value * factor:.3e}")}


def _round_down(value: float) -> float:
    """Rounded down to four significant digits: within the limit, and easy to type."""
    digits = f"{value:.3e}"
    rounded = float(digits)
    return rounded if rounded <= value else float(f"{value - 0.5 * 10.0 ** (int(digits[-3:]) - 3):.3e}")


def _current_in_range(design: Mapping[str, JSON], envelope: Envelope) -> Mapping[str, JSON]:
    low, high = envelope.control.min_current_a, envelope.control.max_current_a

    def clip(value: float) -> float:
        value = value if low is None else max(low, value)
        return value if high is None else min(high, value)

    match design.get("current"):
        case float() | int() as constant:
            return {**design, "current": clip(float(constant))}
        case dict() as band:
            return {**design, "current": {**band, "min": clip(band["min"]), "max": clip(band["max"])}}
    levels = design.get("levels")
    if isinstance(levels, (list, tuple)):
        return {**design, "levels": list(dict.fromkeys(clip(float(str(level))) for level in levels))}
    return design


def check_plan(plan: TestPlan, envelope: Envelope, force_model: ForceModel | None = None) -> tuple[Prediction, ...]:
    """The prediction of each test, in order; raises EnvelopeError for the first test that exceeds the rig.

    The damper's temperature is predicted through tests and dwells where the specimen's heat capacity is known.
    """
    predictions, wrong = predict_plan(plan, envelope, force_model)
    if wrong:
        raise wrong[min(wrong)]
    return predictions


def predict_plan(
    plan: TestPlan, envelope: Envelope, force_model: ForceModel | None = None
) -> tuple[tuple[Prediction, ...], dict[int, EnvelopeError]]:
    """The predictions of the tests that fit, in order, and why each of the others does not, by its number."""
    predictions: list[Prediction] = []
    wrong: dict[int, EnvelopeError] = {}
    for number, test in enumerate(plan.tests):
        try:
            predictions.append(check(test, envelope, force_model))
        except EnvelopeError as error:
            wrong[number] = error
    window = envelope.temperature
    if not wrong and window is not None:
        ends = temperatures(plan, tuple(predictions), envelope)
        number, celsius = next(((n, t) for n, t in enumerate(ends) if t > window.max_degc), (0, window.max_degc))
        if celsius > window.max_degc:
            wrong[number] = EnvelopeError(
                f"test {plan.tests[number].name!r} ends at {celsius:.4g} °C predicted, the limit is "
                f"{window.max_degc:g} °C ({celsius - window.max_degc:.3g} K above); give it and the tests before it a "
                "longer dwell"
            )
    return tuple(predictions), wrong


def temperatures(plan: TestPlan, predictions: tuple[Prediction, ...], envelope: Envelope) -> tuple[float, ...]:
    """Predicted damper temperature at the end of each test, °C; NaN where the specimen's heat capacity is not known."""
    specimen = envelope.specimen
    if specimen is None or specimen.heat_capacity_j_k is None:
        return tuple(float("nan") for _ in plan.tests)
    rise_k, ends = 0.0, []
    for test, predicted in zip(plan.tests, predictions, strict=True):
        rise_k = rise_after(rise_k, test, predicted, envelope)
        ends.append(specimen.ambient_degc + rise_k)
    return tuple(ends)


def rise_after(rise_k: float, test: Test, predicted: Prediction, envelope: Envelope) -> float:
    """The damper's rise above ambient, K, at the end of a test that begins, with its dwell, at ``rise_k``.

    T relaxes to ambient + P/h with the time constant C/h during a test of mean power P, to ambient during a dwell. 0
    where the specimen's heat capacity is not known.
    """
    specimen = envelope.specimen
    if specimen is None or specimen.heat_capacity_j_k is None:
        return 0.0
    rate = specimen.cooling_w_k / specimen.heat_capacity_j_k
    left = exp(-rate * (test.dwell_s + predicted.duration_s))
    return rise_k * left + (predicted.temperature_rise_k or 0.0)


def _flat(design: Mapping[str, JSON], prefix: str = "") -> list[tuple[str, JSON]]:
    flat: list[tuple[str, JSON]] = []
    for key, value in design.items():
        flat += _flat(value, f"{prefix}{key}.") if isinstance(value, Mapping) else [(prefix + key, value)]
    return flat


def _short(value: JSON) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
