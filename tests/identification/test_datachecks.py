"""Data checks: each fault is said, by kind and channel, and a good run says nothing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from identification.datachecks import check_run, findings_in
from identification.discrepancy import explain
from identification.errors import DataError
from identification.fitting import fit
from rigctl.runfile import Run, with_channel
from tests.identification.specimens import AS_SIMULATED, campaign, run

Floats = NDArray[np.float64]


def changed(original: Run, channel: str, change: Callable[[Floats], Floats]) -> Run:
    values = np.asarray(change(original.channels[channel].copy()))
    return replace(original, channels={**original.channels, channel: values})


@pytest.mark.parametrize("index", range(6))
def test_a_good_run_says_nothing(index: int) -> None:
    assert check_run(run("none", index, 3)) == ()


def frozen(values: Floats) -> Floats:
    values[2000:2600] = values[2000]
    return values


def aliased(values: Floats) -> Floats:
    """A harmonic at 1463 Hz, sampled at 1 kHz without a filter."""
    return values + 60.0 * np.sin(2 * np.pi * 1464.0 * np.arange(values.size) / 1000.0)


FAULTS = [
    ("polarity", "force", 0, lambda f: -f, "sign of force or displacement is reversed"),
    ("polarity", "displacement", 2, lambda x: -x, "J dissipated"),
    ("clipping", "force", 2, lambda f: np.clip(f, -np.inf, 0.7 * f.max()), "clipped at its top"),
    ("clipping", "displacement", 1, lambda x: np.clip(x, 0.6 * x.min(), np.inf), "clipped at its bottom"),
    ("frozen", "force", 0, frozen, "from 2.000 to 2.600 s"),
    ("frozen", "displacement", 0, lambda x: np.zeros_like(x), "throughout"),
    ("skew", "force", 2, lambda f: np.roll(f, 12), "11.9 ms behind"),
    ("drift", "force", 2, lambda f: f + np.linspace(0, 90.0, f.size), "N over the run"),
    ("aliasing", "force", 2, aliased, "folded back"),
]


@pytest.mark.parametrize(("kind", "channel", "index", "change", "words"), FAULTS)
def test_a_fault_is_said_with_its_kind_its_channel_and_what_was_seen(
    kind: str, channel: str, index: int, change: Callable[[Floats], Floats], words: str
) -> None:
    found = check_run(changed(run("none", index, 3), channel, change))
    assert kind in [f.kind for f in found], found
    [text] = [str(f) for f in found if f.kind == kind]
    assert words in text, text


@pytest.mark.parametrize(
    ("kind", "channel", "index", "change"), [fault[:4] for fault in FAULTS if fault[4] != "throughout"]
)
def test_explain_says_of_its_runs_what_the_data_checks_saw(
    kind: str, channel: str, index: int, change: Callable[[Floats], Floats]
) -> None:
    """On top of a simulation that has the same fault, so that nothing is missing and no search begins."""
    faulty = changed(run("none", index, 3), channel, change)
    given = with_channel(faulty, "force_simulated", faulty.channels["force"], "N")
    notes = explain(None, [given]).notes
    assert [f"{given.run_id}: {finding}" for finding in check_run(given)] == [
        n for n in notes if n in findings_in([given])
    ]
    assert any(f.kind == kind for f in check_run(given))


def test_explain_and_fit_refuse_a_channel_that_is_frozen_throughout() -> None:
    still = changed(run("none", 0, 3), "force", np.zeros_like)
    for use in (lambda: explain(AS_SIMULATED, [still]), lambda: fit(AS_SIMULATED, [still])):
        with pytest.raises(DataError, match="'force' is frozen at 0"):
            use()


def test_of_a_good_run_explain_says_nothing_of_the_kind() -> None:
    runs, held_out = campaign("none", 4)
    assert findings_in([*runs, *held_out]) == []
    notes = " ".join(explain(AS_SIMULATED, runs, held_out).notes)
    assert not any(word in notes for word in ("clipped", "frozen", "drifts", "reverses", "folded back", "drives"))


def test_the_force_of_a_spring_or_a_mass_is_no_skew() -> None:
    """It is a quarter of a period away from the velocity, whatever the clocks do."""
    own = run("none", 2, 3)
    x = own.channels["displacement"]
    assert "skew" not in [f.kind for f in check_run(changed(own, "force", lambda f: 0.1 * f + 4e4 * x))]


def test_a_sine_that_is_quantised_is_not_clipped() -> None:
    quantised = changed(run("none", 2, 3), "displacement", lambda x: np.round(x, 5))
    assert "clipping" not in [f.kind for f in check_run(quantised)]
