"""A skewed channel is delayed by the ordered time, the others are not, also between two blocks."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from sim_rig.draw import draw
from sim_rig.errors import SkewError
from sim_rig.plant import SimulatedPlant
from sim_rig.sensors import Noise
from sim_rig.skew import CHANNELS, Skew, skew_order

SILENT = Noise(force_n=0.0, displacement_m=0.0, current_a=0.0, temperature_degc=0.0, pressure_pa=0.0)
RATE = 1000.0


def waves(n: int = 400) -> NDArray[np.float64]:
    t = np.arange(n) / RATE
    return np.column_stack([np.sin(2 * np.pi * 10.0 * t + k) for k in range(len(CHANNELS))])


@pytest.mark.parametrize("seconds", [0.0004, 0.001, 0.0037, 0.02])
def test_a_skewed_channel_shows_the_delayed_values_and_the_others_the_present_ones(seconds: float) -> None:
    truth = waves()
    shown = Skew([f"force={seconds}"]).late(truth, RATE)
    t = np.arange(60, 400) / RATE
    assert shown[60:, 0] == pytest.approx(np.sin(2 * np.pi * 10.0 * (t - seconds)), abs=1e-4)
    assert np.array_equal(shown[:, 1:], truth[:, 1:])


def test_the_delay_does_not_depend_on_the_size_of_the_blocks() -> None:
    truth, whole, pieces = waves(), Skew(["displacement=0.0023"]), Skew(["displacement=0.0023"])
    cut = [pieces.late(part, RATE) for part in np.split(truth, [1, 7, 8, 100, 100, 333])]
    assert np.array_equal(np.concatenate(cut), whole.late(truth, RATE))


def test_the_force_of_a_rig_with_skew_is_that_of_one_without_moved_in_time() -> None:
    t = np.arange(2000) / RATE
    setpoints = np.column_stack([0.02 * np.sin(2 * np.pi * 1.5 * t) * np.minimum(t / 0.3, 1.0), np.full(t.size, 0.6)])
    shown = []
    for orders in ([], ["force=0.002"]):
        found = draw("semi-active", (), 1)
        plant = SimulatedPlant(found.damper, SILENT, seed=1, start_degc=40.0, skew=Skew(orders))
        shown.append(plant.play(setpoints))
    assert np.array_equal(shown[0][500:-2, 0], shown[1][502:, 0])
    assert np.array_equal(shown[0][:, 1:], shown[1][:, 1:])


@pytest.mark.parametrize("text", ["speed=0.001", "force", "force=late", "force=-0.001", "force=1", "force=nan"])
def test_an_impossible_skew_is_refused_in_words(text: str) -> None:
    with pytest.raises(SkewError, match=f"skew '{text}': write CHANNEL=SECONDS"):
        skew_order(text)
