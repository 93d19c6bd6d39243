"""Somebody else's simulation as an FMU: which of its variables are ours, and the force that it gives along a run."""

from identification.fmu.model import FmuModel, Patience, open_fmu, with_fmu
from identification.models.choice import Choice

__all__ = ["Choice", "FmuModel", "Patience", "open_fmu", "with_fmu"]
