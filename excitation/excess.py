"""What becomes of the tests of a plan that exceed the rig: refused, dropped, shortened or scaled, and listed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final, Literal, TypeAlias, get_args

from excitation.envelope import check, check_plan, excesses, scale_to_fit
from excitation.errors import DesignError, EnvelopeError
from excitation.plan import Test, TestPlan
from excitation.prediction import ForceModel
from excitation.rig import Envelope
from excitation.signal import JSON, Excitation
from excitation.synthesis import excitation_from_config

__all__ = ["ON_EXCESS", "OnExcess", "fit_plan"]

OnExcess: TypeAlias = Literal["refuse", "drop", "shorten", "scale"]
ON_EXCESS: tuple[str, ...] = get_args(OnExcess)
_LENGTHS: Final = ("cycles", "periods", "duration")
"""Keys of a design that say how long it lasts; the first that it has is made smaller."""


def fit_plan(
    plan: TestPlan, envelope: Envelope, on_excess: OnExcess, force_model: ForceModel | None = None
) -> TestPlan:
    """The plan with what the rig can play, ``changes`` saying what became of each test that it could not.

    "shorten" helps against heat and oil only, "scale" makes the motion smaller. Raises EnvelopeError where a test
    exceeds the rig all the same, or none is left.
    """
    tests, changes = [], []
    for test in plan.tests:
        found = excesses(test.excitation, envelope, force_model) if on_excess != "refuse" else ()
        if not found:
            tests.append(test)
            continue
        if on_excess == "drop":
            changes.append(f"{test.name}: dropped: {found[0]}")
            continue
        fitted = _fitted(test, envelope, on_excess, force_model)
        tests.append(fitted)
        changes.append(f"{test.name}: {_difference(test.excitation, fitted.excitation, on_excess)}: {found[0]}")
    if not tests:
        raise EnvelopeError(f"every test exceeds the rig: {changes[0]}")
    warm_up = plan.warm_up
    if warm_up is not None and on_excess == "scale":
        warm_up = scale_to_fit(warm_up, envelope, force_model)
    if warm_up is not None:
        check(warm_up, envelope, force_model)
    left = replace(plan, tests=tuple(tests), warm_up=warm_up, changes=(*plan.changes, *changes))
    check_plan(left, envelope, force_model)
    return left


def _fitted(test: Test, envelope: Envelope, on_excess: OnExcess, force_model: ForceModel | None) -> Test:
    if on_excess == "scale":
        return scale_to_fit(test, envelope, force_model)
    return replace(test, excitation=_shortened(test, envelope, force_model))


def _shortened(test: Test, envelope: Envelope, force_model: ForceModel | None) -> Excitation:
    """The longest that fits, by bisection of its cycles, periods or duration."""
    design = test.excitation.design
    key = next((key for key in _LENGTHS if isinstance(design.get(key), (int, float))), None)
    if key is None:
        raise EnvelopeError(f"test {test.name!r} cannot be shortened: its design has none of {', '.join(_LENGTHS)}")
    longest = float(str(design[key]))
    grain = longest / 64.0 if key == "duration" else 1.0
    asked = {name: value for name, value in design.items() if name != "frequency_asked"}
    low, high = 0, round(longest / grain)
    while high - low > 1:
        middle = (low + high) // 2
        shorter = _of_length(asked, key, middle * grain)
        low, high = (
            (middle, high) if shorter is not None and not excesses(shorter, envelope, force_model) else (low, middle)
        )
    found = _of_length(asked, key, low * grain) if low else None
    if found is None:
        left = excesses(test.excitation, envelope, force_model)
        raise EnvelopeError(f"test {test.name!r} cannot be shortened to fit: {left[0]}")
    return found


def _of_length(design: Mapping[str, JSON], key: str, length: float) -> Excitation | None:
    """The design of another length; None where it is too short to be one."""
    try:
        return excitation_from_config({**design, key: length if key == "duration" else int(length)})
    except DesignError:
        return None


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
