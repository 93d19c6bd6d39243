"""Black boxes: networks and linear models of the force, identified from runs, free of any physical equation."""

from identification.blackbox.asked import layers_asked, offer_asked, structures_asked
from identification.blackbox.described import identified_data, identified_text, search_data, search_text
from identification.blackbox.given import KINDS, Base, given
from identification.blackbox.hybrid import Hybrid
from identification.blackbox.identify import Identified, identify
from identification.blackbox.layered import LayeredNarx
from identification.blackbox.layers import Layers
from identification.blackbox.model import BlackBox, Member
from identification.blackbox.modelfile import alone_from_json
from identification.blackbox.polynomial import PolynomialNarx
from identification.blackbox.preparation import resampled
from identification.blackbox.recipes import RECIPES
from identification.blackbox.search import Offer, Search, check_searchable, search
from identification.blackbox.structure import Regressor, Structure, regressors
from identification.blackbox.writing import write_identified

__all__ = [
    "KINDS",
    "RECIPES",
    "Base",
    "BlackBox",
    "Hybrid",
    "Identified",
    "LayeredNarx",
    "Layers",
    "Member",
    "Offer",
    "PolynomialNarx",
    "Regressor",
    "Search",
    "Structure",
    "alone_from_json",
    "check_searchable",
    "given",
    "identified_data",
    "identified_text",
    "identify",
    "layers_asked",
    "offer_asked",
    "regressors",
    "resampled",
    "search",
    "search_data",
    "search_text",
    "structures_asked",
    "write_identified",
]
