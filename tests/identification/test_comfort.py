"""Weightings of ISO 2631-1 against its published table, and what follows from them."""

from __future__ import annotations

import numpy as np
import pytest

from identification.errors import DataError
from identification.studies.vehicle.comfort import WEIGHTINGS, comfort

THIRD_OCTAVES = 10.0 ** (np.arange(-10, 27) / 10.0)  # Hz, the exact mid-band frequencies from 0.1 to 400 Hz
# ISO 2631-1:1997, Tables 3 and 4: weighting factors × 1000.
WK = [31.2, 48.6, 79.0, 121, 182, 263, 352, 418, 459, 477, 482, 484, 494, 531, 631, 804, 967, 1039, 1054, 1036, 988,
      902, 768, 636, 513, 405, 314, 246, 186, 132, 88.7, 54.0, 28.5, 15.2, 7.90, 3.98, 1.95]  # fmt: skip
WD = [62.4, 97.3, 158, 243, 365, 530, 713, 853, 944, 992, 1011, 1008, 968, 890, 776, 642, 512, 409, 323, 253, 212, 161,
      125, 100, 80.0, 63.2, 49.4, 38.8, 29.5, 21.1, 14.1, 8.63, 4.55, 2.43, 1.26, 0.64, 0.31]  # fmt: skip
WC = [62.4, 97.3, 158, 243, 364, 527, 708, 843, 929, 972, 991, 1000, 1007, 1012, 1017, 1022, 1024, 1013, 974, 891, 776,
      647, 512, 409, 325, 256, 199, 156, 118, 84.4, 56.7, 34.5, 18.2, 9.71, 5.06, 2.55, 1.25]  # fmt: skip


@pytest.mark.parametrize(("name", "table"), [("Wk", WK), ("Wd", WD), ("Wc", WC)])
def test_a_weighting_is_that_of_the_published_table(name: str, table: list[float]) -> None:
    found = np.abs(WEIGHTINGS[name].response(THIRD_OCTAVES)) * 1e3
    # The table is rounded, and its frequencies are: 2.5 % covers that, 0.2 dB.
    assert np.all(np.abs(found / np.array(table) - 1.0) < 0.055), np.round(found / np.array(table), 3)
    assert np.median(np.abs(found / np.array(table) - 1.0)) < 0.005


@pytest.mark.parametrize("frequency", [1.0, 5.0, 20.0])
def test_a_sine_is_weighted_by_the_factor_of_its_frequency(frequency: float) -> None:
    rate, t = 500.0, np.arange(20000) / 500.0
    found = comfort(np.sin(2.0 * np.pi * frequency * t), rate, settle_s=5.0)
    factor = float(np.abs(WEIGHTINGS["Wk"].response(np.array([frequency])))[0])
    assert found.rms == pytest.approx(factor / np.sqrt(2.0), rel=2e-3)
    assert found.highest == pytest.approx(found.rms, rel=2e-2)
    # of a sine the mean fourth power is 3/8 of that of its amplitude
    assert found.dose == pytest.approx(factor * (0.375 * 35.0) ** 0.25, rel=2e-3)


def test_comfort_is_told_in_the_words_of_the_standard_and_bad_input_in_one_line() -> None:
    t = np.arange(5000) / 500.0
    assert comfort(0.1 * np.sin(30.0 * t), 500.0).words == "not uncomfortable"
    assert comfort(9.0 * np.sin(30.0 * t), 500.0).words == "extremely uncomfortable"
    with pytest.raises(DataError, match="a second is the least"):
        comfort(t, 500.0, settle_s=9.5)
    with pytest.raises(DataError, match="weighting is 'Wx': use Wk"):
        comfort(t, 500.0, weighting="Wx")
