"""What to play: excitation signals and test plans, as pure functions of a specification."""

from excitation.envelope import Envelope, check, check_plan, read_envelope, scale_to_fit
from excitation.errors import DesignError, EnvelopeError, ExcitationError, ExcitationFileError
from excitation.files import read_excitation, read_plan, write_excitation, write_plan
from excitation.kinds import Kind
from excitation.plan import Test, TestPlan, plan_from_config, test_from_config
from excitation.signal import Excitation

__all__ = [
    "DesignError",
    "Envelope",
    "EnvelopeError",
    "Excitation",
    "ExcitationError",
    "ExcitationFileError",
    "Kind",
    "Test",
    "TestPlan",
    "check",
    "check_plan",
    "plan_from_config",
    "read_envelope",
    "read_excitation",
    "read_plan",
    "scale_to_fit",
    "test_from_config",
    "write_excitation",
    "write_plan",
]
