"""Least squares over several runs, with exact gradients and uncertainty."""

from identification.fitting.advice import warnings
from identification.fitting.asked import fit_as_asked
from identification.fitting.base import simple_base
from identification.fitting.described import Intervals, fit_data, fit_text
from identification.fitting.fit import fit
from identification.fitting.leastsquares import Fit, fit_records
from identification.fitting.multistart import ManyFits, fit_from_many
from identification.fitting.profile import Profile, intervals_of, profile
from identification.fitting.questions import moved_far

__all__ = [
    "Fit",
    "Intervals",
    "ManyFits",
    "Profile",
    "fit",
    "fit_as_asked",
    "fit_data",
    "fit_from_many",
    "fit_records",
    "fit_text",
    "intervals_of",
    "moved_far",
    "profile",
    "simple_base",
    "warnings",
]
