"""A foreign simulation as an FMU: its variables connected to channels, and its force along a run."""

from identification.fmu.model import FmuModel, Patience, describe_fmu, open_fmu, with_fmu
from identification.fmu.simulate import Described
from identification.fmu.wiring import Variable
from identification.models.choice import Choice

__all__ = ["Choice", "Described", "FmuModel", "Patience", "Variable", "describe_fmu", "open_fmu", "with_fmu"]
