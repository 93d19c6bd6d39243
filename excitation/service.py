"""A measured service record: its spectrum for the design, and whether the design's range contains it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from excitation.errors import DesignError
from excitation.multisine import Period
from excitation.multisine_spec import MultisineSpec
from excitation.signal import JSON
from excitation.spectra import RecordSpectrum
from excitation.untrusted import DAMAGE, open_hdf5

__all__ = ["ServiceRecord", "contained_share", "read_record", "service_figures", "with_record"]

_MOST_POINTS = 400  # of the spectrum table


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ServiceRecord:
    """Displacement as measured in service, without its mean, and the velocity below ``f_max``; (N,) each."""

    displacement_m: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]


def with_record(spec: MultisineSpec) -> tuple[MultisineSpec, ServiceRecord | None]:
    """The specification with the record's spectrum filled in, and the record; both as they were without one.

    A spectrum that is already filled in (a design made again) is left alone, and no file is read.
    """
    asked = spec.displacement.spectrum
    if not isinstance(asked, RecordSpectrum) or asked.frequency_hz:
        return spec, None
    displacement, rate = read_record(Path(asked.record), asked.channel)
    low, high = spec.displacement.f_min_hz, spec.displacement.f_max_hz
    if high > 0.5 * rate:
        raise DesignError(
            f"displacement.f_max is {high:g} Hz: {asked.record} was sampled at {rate:g} Hz and says nothing "
            "above "
            f"{0.5 * rate:g} Hz"
        )
    frequency, amplitude = _amplitude_spectrum(displacement, rate, low, high)
    filled = replace(
        asked,
        record=Path(asked.record).name,
        frequency_hz=tuple(frequency.tolist()),
        amplitude=tuple(amplitude.tolist()),
    )
    record = _band_limited(displacement, rate, high)
    return replace(spec, displacement=replace(spec.displacement, spectrum=filled)), record


def read_record(path: Path, channel: str) -> tuple[NDArray[np.float64], float]:
    """The channel of a run or excitation file (.h5), (N,), m, and its sample rate, Hz.

    Raises DesignError that names the file and what is wrong with it.
    """
    try:
        with open_hdf5(path, DesignError) as file:
            channels = file.get("channels", {})
            if channel not in channels:
                raise DesignError(f"{path}: there is no channel {channel!r}: it has {', '.join(channels) or 'none'}")
            values = np.asarray(channels[channel][()], dtype=np.float64)
            unit, rate = channels[channel].attrs.get("unit"), float(file.attrs.get("sample_rate", 0.0))
    except DesignError:
        raise
    except DAMAGE as error:
        raise DesignError(f"{path}: no HDF5 file that can be read: give a run file") from error
    if unit != "m" or not rate > 0.0:
        raise DesignError(f"{path}: channel {channel} has unit {unit!r} at {rate:g} Hz: it must be 'm' above 0 Hz")
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size or values.size < 64 or np.ptp(values) == 0.0:
        what = f"sample {bad[0]} is {values[bad[0]]}" if bad.size else f"{values.size} samples, or no motion"
        raise DesignError(f"{path}: channel {channel}: {what}: give 64 or more finite samples that move")
    return values, rate


def _amplitude_spectrum(
    displacement: NDArray[np.float64], rate_hz: float, low_hz: float, high_hz: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Root of the power density by averaged, half-overlapping Hann segments (Welch 1967), from f_min to
    f_max.
    """
    length = int(min(displacement.size, max(64, np.ceil(rate_hz * _MOST_POINTS / high_hz))))
    window = np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2
    starts = range(0, displacement.size - length + 1, max(1, length // 2))
    power = np.zeros(length // 2 + 1)
    for start in starts:
        segment = displacement[start : start + length]
        spectrum = np.fft.rfft(window * (segment - segment.mean()))
        power += spectrum.real * spectrum.real + spectrum.imag * spectrum.imag
    frequency = np.arange(power.size) * (rate_hz / length)
    amplitude = np.sqrt(power / len(starts))
    inside = (frequency > low_hz) & (frequency < high_hz) & (frequency > 0)
    ends = np.interp([low_hz, high_hz], frequency[1:], amplitude[1:])
    return (
        np.concatenate([[low_hz], frequency[inside], [high_hz]]),
        np.concatenate([ends[:1], amplitude[inside], ends[1:]]),
    )


def _band_limited(displacement: NDArray[np.float64], rate_hz: float, high_hz: float) -> ServiceRecord:
    """Velocity by DFT below ``high_hz`` of the record without the line through its ends; the outer 2 %, where
    the jump from end to beginning causes ringing, are left out."""
    size = displacement.size
    line = np.linspace(displacement[0], displacement[-1], size)
    spectrum = np.fft.rfft(displacement - line)
    omega = 2.0 * np.pi * rate_hz / size * np.arange(spectrum.size)
    spectrum[omega > 2.0 * np.pi * high_hz] = 0.0
    velocity = np.fft.irfft(1j * omega * spectrum, n=size) + (displacement[-1] - displacement[0]) * rate_hz / size
    edge = size // 50
    inner = slice(edge, size - edge)
    return ServiceRecord(displacement_m=(displacement - displacement.mean())[inner], velocity_m_s=velocity[inner])


def service_figures(spec: MultisineSpec, period: Period, record: ServiceRecord) -> Mapping[str, JSON]:
    """What a file says of the record: the share contained and the record's outline on the stroke-velocity
    chart.

    Raises DesignError where less than the asked share of the record lies inside the design's range: otherwise
    the model would not be trained over the range of service.
    """
    asked = spec.displacement.spectrum
    training = _scaled(period.displacement_m, period.velocity_m_s, spec)
    service = _scaled(record.displacement_m, record.velocity_m_s, spec)
    share = contained_share(training, service)
    if isinstance(asked, RecordSpectrum) and share < asked.min_contained:
        raise DesignError(
            f"displacement: the design contains {100 * share:.4g} % of the stroke-velocity points of "
            f"{asked.record}, "
            f"min_contained asks for {100 * asked.min_contained:g} %: raise max_displacement "
            f"({spec.displacement.max_displacement_m:g} m, service reaches "
            f"{_peak(record.displacement_m):.4g} m) or "
            f"max_velocity ({spec.displacement.max_velocity_m_s:g} m/s, service "
            f"{_peak(record.velocity_m_s):.4g} m/s)"
        )
    outline = service[_hull(service)]
    return {
        "service_contained": share,
        "service_outline": {
            "displacement": (outline[:, 0] * spec.displacement.max_displacement_m).tolist(),
            "velocity": (outline[:, 1] * spec.displacement.max_velocity_m_s).tolist(),
        },
    }


def contained_share(training: NDArray[np.float64], service: NDArray[np.float64]) -> float:
    """Share of the points ``service`` (M, 2) inside the convex hull of ``training`` (N, 2)."""
    from scipy.spatial import ConvexHull  # 0.2 s: only where a record is given

    planes = ConvexHull(training).equations
    outline = service[_hull(service)]
    if (outline @ planes[:, :2].T + planes[:, 2] <= 1e-12).all():
        return 1.0
    inside = np.ones(len(service), dtype=bool)
    for a, b, c in planes:
        inside &= service[:, 0] * a + service[:, 1] * b + c <= 1e-12
    return float(inside.mean())


def _hull(points: NDArray[np.float64]) -> NDArray[np.int64]:
    from scipy.spatial import ConvexHull

    return np.asarray(ConvexHull(points).vertices, dtype=np.int64)


def _scaled(x: NDArray[np.float64], v: NDArray[np.float64], spec: MultisineSpec) -> NDArray[np.float64]:
    return np.stack([x / spec.displacement.max_displacement_m, v / spec.displacement.max_velocity_m_s], axis=1)


def _peak(values: NDArray[np.float64]) -> float:
    return float(np.abs(values).max())
