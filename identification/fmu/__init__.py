"""Somebody else's simulation as an FMU: which of its variables are ours, and the force that it gives along a run."""

from identification.fmu.simulate import with_fmu
from identification.fmu.wiring import Choice

__all__ = ["Choice", "with_fmu"]
