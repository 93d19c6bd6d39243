"""A foreign simulation as an FMU: its variables connected to channels, and its force along a run."""

from identification.fmu.model import FmuModel, Patience, describe_fmu, open_fmu, with_fmu
from identification.fmu_process.choice import Choice
from identification.fmu_process.simulate import Described
from identification.fmu_process.wiring import Variable

__all__ = ["Choice", "Described", "FmuModel", "Patience", "Variable", "describe_fmu", "open_fmu", "with_fmu"]
