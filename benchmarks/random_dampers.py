"""Records of simulated dampers in a random motion: eight laws of which none is an element of this project's models.

Displacement, velocity and force at 200 Hz, of 0.1 m/s rms in a band of some hertz. The displacement has noise of 20 µm,
the velocity of 1 %, the force of 2 to 4 % and steps of a fortieth of its rms.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, sosfiltfilt

from rigctl.runfile import Run

Floats = NDArray[np.float64]

RATE_HZ, SAMPLES = 200.0, 3500
FINE = 50  # steps of the simulation in a sample
BANDS_HZ = {"slow": (0.3, 2.0), "middle": (0.5, 5.0), "fast": (1.0, 10.0)}
SPEED_M_S, STEPS = 0.1, 40.0
_BEFORE = 400  # samples before the record, in which a law forgets its start


@dataclass(frozen=True, slots=True)
class Moved:
    """A motion in fine steps of `dt`, s, and the sizes of the forces of a law: yield force and viscous force, N."""

    x: Floats
    v: Floats
    dt: float
    yielding: float
    viscous: float
    rng: np.random.Generator

    @property
    def stroke(self) -> float:
        """The rms displacement, m."""
        return float(np.std(self.x))

    @property
    def speed(self) -> float:
        """The rms velocity, m/s."""
        return float(np.std(self.v))

    @property
    def oil(self) -> Floats:
        """A linear dashpot, N."""
        return self.viscous * self.v / self.speed


@dataclass(frozen=True, slots=True)
class Record:
    """A run, and the fit, %, that a model without any error would have on its last 1 500 samples: noise and steps."""

    run: Run
    limit: float


def records(seed: int = 1000) -> Iterator[Record]:
    """Two records of each law: one in the middle band, one in a slower or faster one."""
    for k, law in enumerate(LAWS):
        for turn, (band, noise) in enumerate(
            (("middle", 0.03), ("fast" if k % 2 else "slow", 0.04 if k % 3 == 0 else 0.02))
        ):
            yield record(law, band, noise, np.random.default_rng(seed + 10 * k + turn))


def record(law: str, band: str, noise: float, rng: np.random.Generator) -> Record:
    """A law in a band, with `noise` times the rms of the force."""
    moved = _moved(band, rng)
    taken = slice(_BEFORE * FINE, None, FINE)
    clean = LAWS[law](moved)[taken]
    size = float(np.std(clean))
    noisy = clean + noise * size * rng.standard_normal(clean.size)
    force = np.round(noisy * STEPS / size) * size / STEPS
    channels = {
        "displacement": moved.x[taken] + 2e-5 * rng.standard_normal(clean.size),
        "velocity": moved.v[taken] + 0.01 * moved.speed * rng.standard_normal(clean.size),
        "force": force,
    }
    run = Run(
        run_id=f"{law}-{band}", created="2026-01-01T00:00:00+00:00", specimen=law, sample_rate_hz=RATE_HZ,
        period_samples=0, excitation_kind="custom", status="complete", channels=channels,
        units={"displacement": "m", "velocity": "m/s", "force": "N"},
    )  # fmt: skip
    last = slice(-1500, None)
    return Record(run, 100.0 * (1.0 - float(np.std((force - clean)[last]) / np.std(force[last]))))


def _moved(band: str, rng: np.random.Generator) -> Moved:
    dt, size, spare = 1.0 / (RATE_HZ * FINE), (SAMPLES + _BEFORE) * FINE, 1600 * FINE
    sections = butter(3, BANDS_HZ[band], "band", fs=1.0 / dt, output="sos")
    v = sosfiltfilt(sections, rng.standard_normal(size + 2 * spare))[spare : spare + size]
    v *= SPEED_M_S / np.std(v)
    x = np.cumsum(v) * dt
    return Moved(x - x.mean(), v, dt, rng.uniform(50.0, 90.0), rng.uniform(15.0, 60.0), rng)


def _hyperbolic(m: Moved) -> Floats:
    """A steep step of the velocity that the side of the displacement shifts (Kwok et al. 2006)."""
    steep, shift = m.rng.uniform(2.0, 6.0) / m.speed, m.rng.uniform(0.1, 0.5)
    side = np.sign(m.x) * np.minimum(np.abs(m.x) / m.stroke, 1.5)
    return m.oil + m.yielding * np.tanh(steep * m.v + shift * side) + 0.2 * m.yielding * m.x / m.stroke


def _bent(m: Moved, moved: Callable[[int, float], float], rate: float) -> Floats:
    """z' = rate·(w − (abs(w)·abs(z)·z + w·z²)/2), the hysteresis of Bouc and Wen, w = moved(k, z)."""
    z, out = 0.0, np.empty(m.v.size)
    for k in range(out.size):
        w = moved(k, z)
        z += m.dt * rate * (w - 0.5 * (abs(w) * abs(z) * z + w * z * z))
        out[k] = z
    return out


def _bouc_wen(m: Moved) -> Floats:
    """Bouc-Wen hysteresis, a dashpot and a spring."""
    v = m.v.tolist()
    z = _bent(m, lambda k, _: v[k], m.rng.uniform(15.0, 60.0) / m.stroke)
    return m.oil + m.yielding * z + 0.1 * m.yielding * m.x / m.stroke


def _series_dashpot(m: Moved) -> Floats:
    """Bouc-Wen hysteresis, dashpot and spring behind a second dashpot (Spencer et al. 1997)."""
    rate, c = m.rng.uniform(20.0, 60.0) / m.stroke, m.viscous / m.speed
    behind, k0 = c * m.rng.uniform(4.0, 12.0), 0.3 * m.yielding / m.stroke
    x, v, y, out = m.x.tolist(), m.v.tolist(), 0.0, np.empty(m.v.size)

    def moved(k: int, z: float) -> float:
        nonlocal y
        slip = (m.yielding * z + c * v[k] + k0 * (x[k] - y)) / (c + behind)
        y += m.dt * slip
        out[k] = behind * slip
        return float(v[k] - slip)

    _bent(m, moved, rate)
    return out + 0.05 * m.yielding * m.x / m.stroke


def _soft_mount(m: Moved) -> Floats:
    """A dashpot with a step of the velocity, behind a spring: K·q = c·w + f·tanh(w/s), w = v − q'."""
    k, s, c = m.yielding / (m.stroke * m.rng.uniform(0.02, 0.08)), 0.15 * m.speed, m.viscous / m.speed
    v, q, w, out = m.v.tolist(), 0.0, 0.0, np.empty(m.v.size)
    for n in range(out.size):
        aim = k * (q + m.dt * v[n])
        for _ in range(30):  # damped Newton steps of the implicit equation
            bend = float(np.tanh(w / s))
            slope = c + m.yielding / s * (1.0 - bend * bend) + k * m.dt
            step = (c * w + m.yielding * bend + k * m.dt * w - aim) / slope
            w -= 0.9 * step
            if abs(step) < 1e-9:
                break
        q += m.dt * (v[n] - w)
        out[n] = k * q
    return out


def _bristles(m: Moved) -> Floats:
    """Bristles with a peak of friction at rest (Canudas de Wit et al. 1995), and oil that grows less than linearly."""
    stiff, peak = m.yielding / (m.stroke * m.rng.uniform(0.01, 0.05)), m.rng.uniform(0.1, 0.5)
    most = m.yielding * (1.0 + peak * np.exp(-((m.v / (0.2 * m.speed)) ** 2)))
    z, out = 0.0, np.empty(m.v.size)
    for k in range(out.size):
        z += m.dt * (m.v[k] - stiff * abs(m.v[k]) / most[k] * z)
        out[k] = stiff * z
    return out + m.oil / (1.0 + np.abs(m.v) / (3.0 * m.speed))


def _lagged(m: Moved) -> Floats:
    """A force that is stronger on one side, through a first-order lag."""
    lag = m.rng.uniform(0.004, 0.02)
    force = m.oil + m.yielding * np.tanh(m.v / (0.25 * m.speed))
    force = np.where(force > 0.0, 1.25 * force, force) + 0.15 * m.yielding * m.x / m.stroke
    return np.asarray(lfilter([m.dt / lag], [1.0, m.dt / lag - 1.0], force))


def _notched(m: Moved) -> Floats:
    """Bouc-Wen hysteresis that loses 40 % at one place while it extends, and a mass."""
    v = m.v.tolist()
    z = _bent(m, lambda k, _: v[k], m.rng.uniform(20.0, 50.0) / m.stroke)
    notch = 0.4 * np.exp(-(((m.x / m.stroke - 0.5) / 0.3) ** 2)) * (m.v > 0.0)
    return m.oil + m.yielding * z * (1.0 - notch) + 0.004 * m.yielding * np.gradient(m.v, m.dt) / m.speed


def _many_widths(m: Moved) -> Floats:
    """Six stop operators, and oil whose strength follows the displacement."""
    widths, parts = m.stroke * np.array([0.02, 0.05, 0.1, 0.2, 0.4, 0.8]), m.rng.uniform(0.5, 1.5, 6)
    stops, out = np.zeros(6), np.empty(m.v.size)
    for k in range(out.size):
        stops = np.clip(stops + m.dt * m.v[k], -widths, widths)
        out[k] = m.yielding * float(parts @ (stops / widths)) / float(parts.sum())
    return out + m.oil * (0.6 + 0.4 * np.tanh(m.x / m.stroke))


LAWS: dict[str, Callable[[Moved], Floats]] = {
    "hyperbolic": _hyperbolic, "bouc-wen": _bouc_wen, "series-dashpot": _series_dashpot, "soft-mount": _soft_mount,
    "bristles": _bristles, "lagged": _lagged, "notched": _notched, "many-widths": _many_widths,
}  # fmt: skip
