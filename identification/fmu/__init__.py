"""A foreign simulation as an FMU: its variables connected to channels, and its force along a run."""

from identification.fmu.model import FmuModel, Patience, open_fmu, with_fmu
from identification.models.choice import Choice

__all__ = ["Choice", "FmuModel", "Patience", "open_fmu", "with_fmu"]
