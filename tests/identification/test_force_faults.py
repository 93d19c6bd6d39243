"""A force that is something else for one sample: told in one line, and not learned from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.random_dampers import record
from identification.blackbox import Structure, identify, regressors
from identification.datachecks import findings_in
from identification.force_faults import bridged, spikes_in
from rigctl.runfile import Run, with_channel
from tests.identification.hysteretic import hysteretic

SMALL = [Structure(regressors("v0 P0 R0"), 4)]


def spiked(run: Run, places: list[int], by: float = 2e5) -> Run:
    """Its load cell gives so many newtons more at some samples."""
    force = run.channels["force"].copy()
    force[places] += by
    return with_channel(run, "force", force, "N")


def test_single_samples_that_stand_off_are_told_with_where_how_far_and_what_is_usual() -> None:
    (line,) = [one for one in findings_in([spiked(hysteretic(1, 900), [300, 700])]) if "one sample" in one]
    assert line.startswith("hysteretic-1: force: it is 1.999e+05 N for one sample at 1.5 s and for 1 more, between")
    assert "where nine tenths lie in [" in line
    assert "check its cable" in line


def test_noise_coarse_steps_reversals_and_strokes_against_a_stop_are_no_spikes() -> None:
    run = hysteretic(2, 900, noise=0.1)
    assert spikes_in(run).size == 0
    assert spikes_in(record("bristles", "fast", 0.04, np.random.default_rng(3)).run).size == 0
    assert spikes_in(spiked(run, [400, 401])).size == 0


def test_the_peaks_of_a_short_motion_in_a_long_rest_are_no_spikes_and_one_that_towers_over_them_is() -> None:
    rng = np.random.default_rng(7)
    drop = hysteretic(1, 4000)
    force = rng.normal(0.0, 1.0, 4000)
    force[2000:2150] += 1000.0 * np.sin(2.0 * np.pi * np.arange(150) / 9.5)  # nine samples a cycle
    run = with_channel(drop, "force", force, "N")
    assert spikes_in(run).size == 0
    assert bridged(run) is run
    assert spikes_in(spiked(run, [2030, 3000])).tolist() == [2030, 3000]
    still = with_channel(run, "force", np.where(np.abs(force) < 5.0, 0.0, force), "N")
    assert spikes_in(still).size == 0


def test_a_spike_of_every_period_belongs_to_the_machine_and_one_of_a_single_period_does_not() -> None:
    one = spiked(hysteretic(1, 600), [200])
    every = replace(one, channels={name: np.tile(x, 3) for name, x in one.channels.items()}, period_samples=600)
    assert spikes_in(every).size == 0
    assert spikes_in(spiked(every, [900])).tolist() == [900]


def test_what_is_learned_of_a_force_with_spikes_is_what_is_learned_without_them() -> None:
    run, shown = hysteretic(1, 1200), hysteretic(5, 600)
    places = [*range(0, 1200, 211), 1199]
    assert np.max(np.abs(bridged(spiked(run, places)).channels["force"] - run.channels["force"])) < 100.0
    clean = identify("nnoe", [run], held_out=[shown], structures=SMALL)
    hurt = identify("nnoe", [spiked(run, places)], held_out=[shown], structures=SMALL)
    (fit,), (known,) = hurt.shown.values(), clean.shown.values()
    assert abs(fit - known) < 0.5
    (note,) = hurt.notes
    assert note.endswith("the mean of its neighbours is learned")
    assert clean.notes == ()
