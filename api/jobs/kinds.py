"""The kinds of jobs. A new kind is a file like ``fit.py`` and its entries here."""

from __future__ import annotations

from api.errors import InputError
from api.jobs.analyse import ANALYSE, AnalyseRequest
from api.jobs.characterise import CHARACTERISE, CharacteriseRequest
from api.jobs.compare import COMPARE, CompareRequest
from api.jobs.complexity import COMPLEXITY, ComplexityRequest
from api.jobs.explain import EXPLAIN, ExplainRequest
from api.jobs.explore import EXPLORE, ExploreRequest
from api.jobs.fit import FIT, FitRequest
from api.jobs.identify import IDENTIFY, IdentifyRequest
from api.jobs.kind import Kind
from api.jobs.multi_axis import MULTI_AXIS, MultiAxisRequest
from api.jobs.realtime import REALTIME, RealtimeRequest
from api.jobs.sensitivity import SENSITIVITY, SensitivityRequest
from api.jobs.service_range import RANGE, RangeRequest
from api.jobs.vehicle import VEHICLE, VehicleRequest

__all__ = ["KINDS", "AnyRequest", "find_kind"]

_ALL = (
    EXPLAIN,
    FIT,
    CHARACTERISE,
    COMPARE,
    IDENTIFY,
    ANALYSE,
    EXPLORE,
    SENSITIVITY,
    COMPLEXITY,
    VEHICLE,
    MULTI_AXIS,
    RANGE,
    REALTIME,
)
KINDS = {kind.name: kind for kind in _ALL}
AnyRequest = (
    ExplainRequest
    | FitRequest
    | CharacteriseRequest
    | CompareRequest
    | IdentifyRequest
    | VehicleRequest
    | AnalyseRequest
    | ExploreRequest
    | SensitivityRequest
    | ComplexityRequest
    | MultiAxisRequest
    | RangeRequest
    | RealtimeRequest
)


def find_kind(name: str) -> Kind:
    """The kind with this name; raises InputError for a name that this version does not have."""
    if name not in KINDS:
        raise InputError(f"kind is {name!a:.60}: this version has {', '.join(KINDS)}")
    return KINDS[name]
