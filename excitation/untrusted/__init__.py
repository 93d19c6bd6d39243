"""Files from elsewhere: HDF5 and JSON are checked as a whole before anything in them is used."""

from excitation.untrusted.hdf5_file import DAMAGE, open_hdf5
from excitation.untrusted.json_text import parse_json
from excitation.untrusted.limits import Limits
from excitation.untrusted.mat_file import check_mat
from excitation.untrusted.memory_bound import bounded_memory

__all__ = ["DAMAGE", "Limits", "bounded_memory", "check_mat", "open_hdf5", "parse_json"]
