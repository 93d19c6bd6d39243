"""A service record: the design has its spectrum and contains its range, or is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

from excitation.design import design, design_file, remake
from excitation.errors import DesignError
from excitation.files import read_excitation, write_excitation
from excitation.portable_math import uniform
from excitation.service import contained_share
from excitation.signal import Excitation

CONFIG: dict[str, Any] = {
    "sample_rate": 500.0,
    "period_samples": 4096,
    "displacement": {
        "f_min": 0.5,
        "f_max": 20.0,
        "max_displacement": 0.05,
        "max_velocity": 0.8,
        "spectrum": {"record": "service.h5"},
    },
}


def service(path: Path, peak_m: float = 0.02, unit: str = "m") -> NDArray[np.float64]:
    """A record whose spectrum is flat to 4 Hz and falls as 1/f² beyond; 60 s at 200 Hz, not periodic."""
    frequency = np.fft.rfftfreq(16_384, 1 / 200.0)
    amplitude = np.where(frequency < 0.3, 0.0, 1.0 / (1.0 + (frequency / 4.0) ** 2))
    amplitude[frequency > 30.0] = 0.0
    phase = 2 * np.pi * uniform((3,), frequency.size)
    record = np.fft.irfft(amplitude * np.exp(1j * phase))[:12_000]
    record *= peak_m / np.abs(record).max()
    with h5py.File(path, "w") as file:
        file.attrs["sample_rate"] = 200.0
        file["channels/displacement"] = 0.003 + record
        file["channels/displacement"].attrs["unit"] = unit
    return record


def config(folder: Path, **changes: Any) -> dict[str, Any]:
    displacement = {**CONFIG["displacement"], "spectrum": {"record": str(folder / "service.h5")}, **changes}
    return {**CONFIG, "displacement": displacement}


def test_the_design_has_the_spectrum_of_the_record_at_larger_amplitude(tmp_path: Path) -> None:
    record = service(tmp_path / "service.h5")
    made = design("random-phase", config(tmp_path))
    assert isinstance(made, Excitation)
    assert np.abs(made.displacement_m).max() > np.abs(record).max()
    lines = np.abs(np.fft.rfft(made.displacement_m))
    frequency = np.arange(lines.size) * 500.0 / 4096

    def level(low: float, high: float) -> float:
        return float(np.sqrt(np.mean(lines[(frequency >= low) & (frequency < high)] ** 2)))

    assert level(12.0, 16.0) / level(1.0, 3.0) == pytest.approx((1 + 0.25) / (1 + 3.5**2), rel=0.2)
    share: Any = made.figures["service_contained"]
    assert share >= 0.99


def test_a_range_that_does_not_contain_service_is_refused(tmp_path: Path) -> None:
    service(tmp_path / "service.h5", peak_m=0.08)
    with pytest.raises(DesignError, match=r"min_contained asks for 99 %: raise max_displacement") as refused:
        design("random-phase", config(tmp_path))
    assert "\n" not in str(refused.value)
    spectrum = {"record": str(tmp_path / "service.h5"), "min_contained": 0.0}
    made = design("random-phase", config(tmp_path, spectrum=spectrum))
    assert isinstance(made, Excitation)
    share: Any = made.figures["service_contained"]
    assert 0.0 < share < 0.99


@pytest.mark.slow
def test_the_design_is_made_again_without_the_record(tmp_path: Path) -> None:
    service(tmp_path / "service.h5")
    made = design("homogenised", {**config(tmp_path), "period_samples": 1024})
    assert isinstance(made, Excitation)
    write_excitation(tmp_path / "x.h5", made)
    (tmp_path / "service.h5").unlink()
    again = remake(read_excitation(tmp_path / "x.h5"))
    assert again.displacement_m.tobytes() == made.displacement_m.tobytes()


def test_the_record_is_looked_for_beside_the_configuration(tmp_path: Path) -> None:
    service(tmp_path / "service.h5")
    text = "sample_rate = 500.0\nperiod_samples = 4096\n[displacement]\nf_min = 0.5\nf_max = 20.0\n"
    text += 'max_displacement = 0.05\nmax_velocity = 0.8\nspectrum = { record = "service.h5" }\n'
    (tmp_path / "c.toml").write_text(text)
    made = design_file("random-phase", tmp_path / "c.toml")
    assert str(tmp_path) not in repr(made.design)


def test_an_unusable_record_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "service.h5"
    service(path, unit="mm")
    with pytest.raises(DesignError, match="unit 'mm'"):
        design("random-phase", config(tmp_path))
    service(path)
    with pytest.raises(DesignError, match="no channel 'stroke'"):
        design("random-phase", config(tmp_path, spectrum={"record": str(path), "channel": "stroke"}))
    with pytest.raises(DesignError, match="says nothing above 100 Hz"):
        design("random-phase", config(tmp_path, f_max=150.0))
    with h5py.File(path, "r+") as file:
        file["channels/displacement"][5] = np.inf
    with pytest.raises(DesignError, match="sample 5 is inf"):
        design("random-phase", config(tmp_path))


def test_the_contained_share_is_that_of_the_convex_hull() -> None:
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    points = 4 * np.stack([uniform((1,), 4000), uniform((2,), 4000)], axis=1) - 2
    assert contained_share(square, points) == np.mean((np.abs(points) <= 1).all(axis=1))
    assert contained_share(square, 0.5 * points) == 1.0
