"""Realisations of several axes from which the responses to every axis can be told apart."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from excitation.configuration import to_spec
from excitation.errors import DesignError
from excitation.multi_axis import MultiAxisSpec, mixing_turns, multi_axis
from excitation.multi_axis_file import write_multi_axis


def config(axes: int, matrix: str = "hadamard") -> dict[str, Any]:
    return {
        "sample_rate": 200.0,
        "period_samples": 400,
        "matrix": matrix,
        "periods": 2,
        "seed": 5,
        "axes": [
            {
                "name": f"axis_{number}",
                "displacement": {
                    "f_min": 0.5, "f_max": 10.0, "max_displacement": 0.01 * (1 + number), "max_velocity": 0.3,
                },
            }
            for number in range(axes)
        ],
    }  # fmt: skip


@pytest.mark.parametrize("matrix", ["hadamard", "dft"])
@pytest.mark.parametrize("axes", [1, 2, 3, 5, 6])
def test_the_matrix_of_the_inputs_can_be_inverted_at_every_line(axes: int, matrix: str) -> None:
    made = multi_axis(to_spec(MultiAxisSpec, config(axes, matrix)))
    for line in range(1, 21):
        inputs = made.input_matrix(line)
        inputs = inputs / np.abs(inputs).max(axis=1, keepdims=True)
        assert np.linalg.cond(inputs) == pytest.approx(1.0)


@pytest.mark.parametrize("matrix", ["hadamard", "dft"])
def test_every_axis_keeps_its_limits_in_every_realisation_and_reaches_one(matrix: str) -> None:
    made = multi_axis(to_spec(MultiAxisSpec, config(6, matrix)))
    spectrum = np.fft.rfft(made.commands, axis=2)
    velocity = np.fft.irfft(spectrum * 2j * np.pi * np.fft.rfftfreq(400, 1 / 200.0), axis=2)
    for number in range(6):
        used = (
            np.abs(made.commands[:, number]).max() / (0.01 * (1 + number)),
            np.abs(velocity[:, number]).max() / 0.3,
        )
        assert max(used) == pytest.approx(1.0, rel=1e-6)
        assert max(used) <= 1.0


def test_responses_of_a_coupled_rig_are_found_exactly() -> None:
    """Six inputs at once, each with a gain to the output: the realisations tell the gains apart."""
    made = multi_axis(to_spec(MultiAxisSpec, config(6)))
    truth = np.arange(1.0, 7.0) * np.exp(0.3j * np.arange(6))
    inputs = made.input_matrix(7)
    found = (truth @ inputs) @ np.linalg.pinv(inputs)
    np.testing.assert_allclose(found, truth, rtol=1e-9)


@pytest.mark.parametrize(("axes", "realisations"), [(1, 1), (2, 2), (3, 4), (4, 4), (5, 8), (6, 8)])
def test_signs_need_a_power_of_two_of_realisations(axes: int, realisations: int) -> None:
    assert mixing_turns("hadamard", axes).shape == (realisations, axes)
    assert mixing_turns("dft", axes).shape == (axes, axes)


def test_a_file_holds_every_realisation(tmp_path: Path) -> None:
    made = multi_axis(to_spec(MultiAxisSpec, config(2)))
    write_multi_axis(tmp_path / "two.h5", made)
    write_multi_axis(tmp_path / "two.csv", made)
    with h5py.File(tmp_path / "two.h5") as file:
        np.testing.assert_array_equal(file["realisation_2/channels/axis_1_command"][:400], made.commands[1, 1])
        assert file.attrs["samples"] == 800
    table = np.loadtxt(tmp_path / "two.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(table[400:, 4], made.commands[1, 1])


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"axes": []}, "one to 6"),
        ({"axes": config(6)["axes"] + [{**config(1)["axes"][0], "name": "seventh"}]}, "one to 6"),
        ({"axes": config(1)["axes"] * 2}, "once"),
        ({"matrix": "random"}, "matrix"),
        ({"axes": [{**config(1)["axes"][0], "name": "a b"}]}, "letters"),
        ({"sample_rate": 15.0}, "half the sample rate"),
        ({"period_samples": 2**24}, "period_samples is"),
        ({"periods": 10**9}, "periods is"),
    ],
)
def test_what_cannot_be_played_is_refused_in_one_line(wrong: dict[str, Any], said: str) -> None:
    with pytest.raises(DesignError, match=said) as refused:
        to_spec(MultiAxisSpec, config(2) | wrong)
    assert "\n" not in str(refused.value)
