"""Least squares over several runs, with exact gradients and uncertainty."""

from identification.fitting.advice import warnings
from identification.fitting.fit import fit
from identification.fitting.leastsquares import Fit, fit_records
from identification.fitting.multistart import ManyFits, fit_from_many
from identification.fitting.profile import Profile, profile

__all__ = ["Fit", "ManyFits", "Profile", "fit", "fit_from_many", "fit_records", "profile", "warnings"]
