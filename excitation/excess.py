"""What becomes of the tests of a plan that exceed the rig: refused, dropped, shortened or scaled, and listed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final, Literal, TypeAlias, get_args

from excitation.envelope import check, check_plan, excesses, rise_after, scale_to_fit
from excitation.errors import DesignError, EnvelopeError
from excitation.plan import Test, TestPlan
from excitation.prediction import ForceModel, predict
from excitation.rig import Envelope
from excitation.signal import JSON, Excitation
from excitation.synthesis import excitation_from_config

__all__ = ["ON_EXCESS", "OnExcess", "fit_plan"]

OnExcess: TypeAlias = Literal["refuse", "drop", "shorten", "scale"]
ON_EXCESS: tuple[str, ...] = get_args(OnExcess)
_LENGTHS: Final = ("cycles", "periods", "duration")
"""Keys of a design that say how long it lasts; the first that it has is made smaller."""

Reason: TypeAlias = Callable[[Test], str]
"""Why the rig cannot play a test at its place in the plan; empty where it can."""


def fit_plan(
    plan: TestPlan, envelope: Envelope, on_excess: OnExcess, force_model: ForceModel | None = None
) -> TestPlan:
    """The plan with what the rig can play, ``changes`` saying what became of each test that it could not.

    "shorten" helps against heat and oil only, "scale" makes the motion smaller; a test that neither helps is left out.
    Heat is that of the test and of those before it. Raises EnvelopeError where no test is left, or the warm-up exceeds
    the rig.
    """
    tests, changes = (plan.tests, []) if on_excess == "refuse" else _fitted(plan, envelope, on_excess, force_model)
    if not tests:
        raise EnvelopeError(f"every test exceeds the rig: {changes[0]}")
    warm_up = plan.warm_up
    if warm_up is not None and on_excess == "scale":
        warm_up = scale_to_fit(warm_up, envelope, force_model)
    if warm_up is not None:
        check(warm_up, envelope, force_model)
    left = replace(plan, tests=tests, warm_up=warm_up, changes=(*plan.changes, *changes))
    check_plan(left, envelope, force_model)
    return left


def _fitted(
    plan: TestPlan, envelope: Envelope, on_excess: OnExcess, force_model: ForceModel | None
) -> tuple[tuple[Test, ...], list[str]]:
    """The tests that the rig can play, one after the other, and a line for each that was changed."""
    tests: list[Test] = []
    changes: list[str] = []
    rise_k = 0.0
    for test in plan.tests:
        reason = _reason(rise_k, envelope, force_model)
        if why := reason(test):
            fitted, change = _changed(test, why, reason, on_excess, envelope, force_model)
            changes.append(f"{test.name}: {change}")
            if fitted is None:
                continue
            test = fitted
        tests.append(test)
        rise_k = rise_after(rise_k, test, predict(test.excitation, envelope, force_model), envelope)
    return tuple(tests), changes


def _reason(rise_k: float, envelope: Envelope, force_model: ForceModel | None) -> Reason:
    """For a test that begins ``rise_k`` above ambient, before its dwell."""

    def reason(test: Test) -> str:
        if found := excesses(test.excitation, envelope, force_model):
            return str(found[0])
        if envelope.temperature is None or envelope.specimen is None:
            return ""
        ends_k = rise_after(rise_k, test, predict(test.excitation, envelope, force_model), envelope)
        ends_degc, most_degc = envelope.specimen.ambient_degc + ends_k, envelope.temperature.max_degc
        if ends_degc <= most_degc:
            return ""
        return f"it ends at {ends_degc:.4g} °C after the tests before it, the limit is {most_degc:g} °C"

    return reason


def _changed(
    test: Test,
    why: str,
    reason: Reason,
    on_excess: OnExcess,
    envelope: Envelope,
    force_model: ForceModel | None,
) -> tuple[Test | None, str]:
    """What is played in its place, None for nothing, and what became of it, in words."""
    if on_excess == "drop":
        return None, f"dropped: {why}"
    try:
        fitted = scale_to_fit(test, envelope, force_model) if on_excess == "scale" else _shortened(test, why, reason)
    except EnvelopeError as error:
        return None, f"left out, {str(error).removeprefix(f'test {test.name!r} ')}"
    if left := reason(fitted):
        return None, f"left out, cannot be scaled to fit: {left}"
    return fitted, f"{_difference(test.excitation, fitted.excitation, on_excess)}: {why}"


def _shortened(test: Test, why: str, reason: Reason) -> Test:
    """The longest that fits, by bisection of its cycles, periods or duration."""
    design = test.excitation.design
    key = next((key for key in _LENGTHS if isinstance(design.get(key), (int, float))), None)
    if key is None:
        raise EnvelopeError(
            f"test {test.name!r} cannot be shortened: its design has none of {', '.join(_LENGTHS)}: {why}"
        )
    longest = float(str(design[key]))
    grain = longest / 64.0 if key == "duration" else 1.0
    asked = {name: value for name, value in design.items() if name != "frequency_asked"}
    low, high = 0, round(longest / grain)
    while high - low > 1:
        middle = (low + high) // 2
        shorter = _of_length(test, asked, key, middle * grain)
        low, high = (middle, high) if shorter is not None and not reason(shorter) else (low, middle)
    found = _of_length(test, asked, key, low * grain) if low else None
    if found is None:
        raise EnvelopeError(f"test {test.name!r} cannot be shortened to fit: {why}")
    return found


def _of_length(test: Test, design: Mapping[str, JSON], key: str, length: float) -> Test | None:
    """The test with its design of another length; None where it is too short to be one."""
    try:
        made = excitation_from_config({**design, key: length if key == "duration" else int(length)})
    except DesignError:
        return None
    return replace(test, excitation=made)


def _difference(before: Excitation, after: Excitation, on_excess: OnExcess) -> str:
    """What the design changed, in words."""
    changed = [
        f"{key} {_short(before.design.get(key))} → {_short(value)}"
        for key, value in after.design.items()
        if before.design.get(key) != value and key != "frequency_asked"
    ]
    return f"{'shortened' if on_excess == 'shorten' else 'scaled'}, {', '.join(changed)}"


def _short(value: JSON) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
