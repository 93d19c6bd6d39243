"""Least squares over several runs, with exact gradients and honest uncertainty."""

from identification.fitting.fit import fit
from identification.fitting.leastsquares import Fit, fit_records

__all__ = ["Fit", "fit", "fit_records"]
