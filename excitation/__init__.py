"""What to play: excitation signals and test plans, as pure functions of a specification."""

from excitation.bounds import Bounds
from excitation.envelope import Envelope, check, check_plan, read_envelope, scale_to_fit
from excitation.errors import DesignError, EnvelopeError, ExcitationError, ExcitationFileError
from excitation.file_drive import FileSpec, file_drive
from excitation.files import read_excitation, read_plan, write_excitation, write_plan
from excitation.harmonic import SineSpec, StepsSpec, TriangleSpec, sine, steps, triangle
from excitation.harmonic_plan import harmonic_plan
from excitation.kinds import Kind
from excitation.lines import LogLines
from excitation.motion import Motion, motion
from excitation.multisine_spec import CurrentSpec, DisplacementSpec, HomogeniseSpec, MultisineSpec
from excitation.noise import Density, NoiseSpec, noise
from excitation.plan import Test, TestPlan, plan_from_config, test_from_config
from excitation.replay import ReplaySpec, replay
from excitation.road_drive import RoadDriveSpec, road_drive
from excitation.road_profile import RoadProfileSpec, RoadRide, ride, road_density, road_profile
from excitation.signal import Excitation
from excitation.sweep import SweepSpec, sweep
from excitation.synthesis import excitation_from_config, homogenised_multisine, multisine

__all__ = [
    "Bounds",
    "CurrentSpec",
    "Density",
    "DesignError",
    "DisplacementSpec",
    "Envelope",
    "EnvelopeError",
    "Excitation",
    "ExcitationError",
    "ExcitationFileError",
    "FileSpec",
    "HomogeniseSpec",
    "Kind",
    "LogLines",
    "Motion",
    "MultisineSpec",
    "NoiseSpec",
    "ReplaySpec",
    "RoadDriveSpec",
    "RoadProfileSpec",
    "RoadRide",
    "SineSpec",
    "StepsSpec",
    "SweepSpec",
    "Test",
    "TestPlan",
    "TriangleSpec",
    "check",
    "check_plan",
    "excitation_from_config",
    "file_drive",
    "harmonic_plan",
    "homogenised_multisine",
    "motion",
    "multisine",
    "noise",
    "plan_from_config",
    "read_envelope",
    "read_excitation",
    "read_plan",
    "replay",
    "ride",
    "road_density",
    "road_drive",
    "road_profile",
    "scale_to_fit",
    "sine",
    "steps",
    "sweep",
    "test_from_config",
    "triangle",
    "write_excitation",
    "write_plan",
]
