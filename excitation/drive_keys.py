"""What the keys of sines, steps, sweeps, noise, roads, replays, presets and joined plans mean."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from excitation.bounds import Bounds
from excitation.file_drive import FileSpec
from excitation.harmonic import SineSpec, StepsSpec, TriangleSpec
from excitation.joined_plan import JoinedPlanSpec, PartSpec
from excitation.limits_given import TestLimits
from excitation.noise import Density, NoiseSpec
from excitation.plan import TestConditions
from excitation.presets import PresetSpec
from excitation.replay import ReplaySpec
from excitation.road_drive import RoadDriveSpec
from excitation.road_profile import RoadProfileSpec
from excitation.sweep import SweepSpec

__all__ = ["DRIVE_MEANINGS"]

_COMMON: Final = {
    "sample_rate": "samples a second",
    "bounds": "largest displacement, velocity and acceleration",
    "level": "share of the signal, after what the bounds scale",
    "current": "constant control current; without it none is played",
    "periods": "periods that are played",
    "seed": "of what is drawn: the same seed gives the same file",
    "realisation": "number of another signal of the same design",
}
_CYCLES: Final = {
    "sample_rate": "samples a second",
    "amplitude": "of the motion",
    "frequency": "of the motion; what is played is at most that",
    "cycles": "cycles that are played, beside the settling ones",
    "settling_cycles": "cycles ahead of these",
    "current": "constant control current; without it none is played",
    "frequency_asked": "filled in where the frequency is not the one that was asked for",
}
_GATES: Final = {
    "dwell": "rest before a test",
    "min_temperature": "a test waits until the damper is as warm",
    "max_temperature": "a test waits until the damper is as cool",
}
DRIVE_MEANINGS: Final[Mapping[type, Mapping[str, str]]] = {
    Bounds: {
        "max_displacement": "limit, from the middle",
        "max_velocity": "limit",
        "max_acceleration": "limit",
        "beyond": "a signal beyond a limit is refused, or scaled down to it",
    },
    SineSpec: _CYCLES,
    TriangleSpec: {**_CYCLES, "corner_time": "time in which the motion reverses"},
    StepsSpec: {
        **_CYCLES,
        "cycles": "cycles of one period of the whole",
        "levels": "currents between which it jumps",
        "step_time": "time from step to step",
        "sequence": "random blocks of all levels, as they are listed, or a pseudo-random binary sequence of two",
        "order": "sequence = \"prbs\": it has 2^order - 1 steps",
        "seed": "of the order of the levels",
        "periods": "how often the whole is played",
    },
    SweepSpec: {
        **_COMMON,
        "f_start": "frequency at the beginning",
        "f_end": "frequency at the end; below f_start it falls",
        "duration": "of the whole",
        "law": "equal steps or equal ratios of frequency in equal times",
        "fade": "time in which it grows from rest and dies away; without it a twentieth of the duration",
    },
    Density: {
        "frequency": "rising; the first and the last bound the band",
        "density": "one-sided power density, unit²/Hz, at these frequencies; straight between them on logarithmic axes",
        "of": "what has this density",
    },
    NoiseSpec: {
        **_COMMON,
        "period_samples": "samples of one period: the lines are sample_rate/period_samples apart",
        "density": "power density",
        "amplitudes": "of the lines: as those of Gaussian noise, or the density exactly",
    },
    RoadProfileSpec: {
        "road_class": "class of ISO 8608, A to H",
        "length": "of the road, which then repeats",
        "seed": "of the road",
        "realisation": "number of another road of the class",
        "min_wavenumber": "longest waves, cycles a metre",
        "max_wavenumber": "shortest waves, cycles a metre",
        "waviness": "exponent of the density",
        "periodic": "whether the end goes over into the beginning: a rig plays no other",
    },
    RoadDriveSpec: {
        **_COMMON,
        "road": "the road",
        "speed": "of the car",
        "quarter_car": "the car",
        "f_max": "what lies above is left out",
    },
    ReplaySpec: {
        **_COMMON,
        "record": "run file, CSV, RPC III or MAT file; its path counts from the configuration",
        "channel": "column or channel that is played",
        "unit": "of the channel, where the file states none",
        "start": "beginning of the part that is played",
        "end": "its end; without it that of the record",
        "sample_rate": "that is played; without it that of the record",
        "f_max": "what lies above is filtered out",
        "fade": "time in which it grows from rest and dies away",
        "scale": "factor on the motion; -1 turns its sign",
        "current_channel": "channel that is played as the current, held between its samples",
        "current_unit": "of that channel, where the file states none",
        "record_sha256": "filled in when the record is read",
    },
    FileSpec: {
        "record": "excitation file; its path counts from the plan",
        "level": "factor on the displacement",
        "record_sha256": "filled in when the file is read",
    },
    PresetSpec: {
        **_GATES,
        "preset": "the sequence",
        "sample_rate": "samples a second",
        "amplitude": "of the stroke",
        "max_velocity": "largest peak velocity; that of cvp",
        "velocities": "peak velocities; without it shares of the largest, 2 to 100 %",
        "frequencies": "of the dynamic series of en-13802",
        "current": "each test at each of these; without it none is played",
        "cycles": "of each sine, beside the settling ones",
        "settling_cycles": "cycles ahead of these",
    },
    JoinedPlanSpec: {
        "parts": "in the order in which they are played: [[parts]]",
        "warm_up": "a test that is played while the damper is too cold",
    },
    PartSpec: {
        **_GATES,
        "name": "first part of the names of its tests",
        "file": "plan or excitation file",
        "command": "that designs the configuration",
        "config": "configuration file",
        "test": "a test: its kind and the keys of the kind",
        "repeats": "how often its tests are played",
    },
    TestConditions: {
        **_GATES,
        "name": "of the test, its own",
        "held_out": "reserved for validation",
        "data_set": "name of the set that it belongs to",
        "before": "steps before it, each a table with step = \"prompt\", \"tare\" or \"gate\" and its keys",
        "on_failure": "where a step or gate refuses",
        "retries": "on_failure = \"retry\": at most so many",
        "energy": "of a warm-up: repeated until the damper has taken up this work, J",
        "to_temperature": "of a warm-up: repeated until the damper is as warm",
        "limits": "tighter than those of the machine and the specimen",
    },
    TestLimits: {
        "max_displacement": "from mid-stroke, either way",
        "max_velocity": "largest speed",
        "max_acceleration": "largest acceleration",
        "max_force": "either way",
        "max_following_error": "of the motion",
        "min_current": "0 or below",
        "max_current": "0 or above",
        "max_temperature": "of the damper",
    },
}  # fmt: skip
