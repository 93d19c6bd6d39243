"""Examples of requests, for the OpenAPI description and the page of the routes; the tests send them all."""

from __future__ import annotations

from typing import Any

from api.campaigns.typed_tests import EXAMPLES

__all__ = ["REQUESTS"]

_MODEL = {
    "format": "damper-rig/model",
    "format_version": 1,
    "name": "viscous damper",
    "kind": "physical",
    "paths": {"core": [{"element": "viscous_damping", "parameters": {"c": 1500.0}}]},
}
_WHERE = {"rig": "modbus://127.0.0.1:5020", "specimen": "damper 7"}
_COMFORT = {"name": "comfort", "output": "weighted acceleration"}
_AXIS = {"f_min": 0.5, "f_max": 20.0, "max_displacement": 0.02, "max_velocity": 0.4}
_AXES = [{"name": "stroke", "displacement": _AXIS}, {"name": "tilt", "unit": "rad", "displacement": _AXIS}]
_CAMPAIGN = "4f2c1d0e9b8a47769d5e3c2b1a0f9e8d"  # the id of a campaign whose runs a job uses
_RUN = "0b1c2d3e4f5a46978b9c0d1e2f3a4b5c"  # the id of a run

REQUESTS: dict[str, list[dict[str, Any]]] = {  # by the class of the body. Any: JSON
    "NewCampaign": [
        {"name": "first look", **_WHERE, "tests": list(EXAMPLES)},
        {
            "name": "with limits",
            **_WHERE,
            "tests": [EXAMPLES[0]],
            "interlocks": ["force:-8e3:8e3:stop:0.01"],
            "envelopes": [{"motion": {"max_displacement": 0.05, "max_velocity": 1.5}}],
        },
    ],
    "NewDesign": [{"name": "matrix", "tests": list(EXAMPLES)}],
    "ExplainRequest": [{"campaign": _CAMPAIGN, "model": _MODEL}],
    "FitRequest": [{"kind": "fit", "campaign": _CAMPAIGN, "model": _MODEL, "starts": 4}],
    "CharacteriseRequest": [{"kind": "characterise", **_WHERE}],
    "AnalyseRequest": [{"kind": "analyse", **_WHERE}],
    "CompareRequest": [{"kind": "compare", "campaign": _CAMPAIGN, "models": [_MODEL]}],
    "ExploreRequest": [{"kind": "explore", **_WHERE, "model": _MODEL, "study": {"samples": 200}}],
    "SensitivityRequest": [{"kind": "sensitivity", **_WHERE, "model": _MODEL}],
    "ComplexityRequest": [{"kind": "complexity", **_WHERE, "model": _MODEL, "plan": {"step": [_COMFORT]}}],
    "VehicleRequest": [{"kind": "vehicle", "models": [_MODEL], "vehicle": "car", "study": {"road_class": "C"}}],
    "MultiAxisRequest": [
        {"kind": "multi_axis", "design": {"sample_rate": 500.0, "period_samples": 1000, "axes": _AXES}}
    ],
    "RangeRequest": [
        {
            "kind": "range",
            "runs": [_RUN],
            "trained": [_RUN],
            "envelope": {"motion": {"max_displacement": 0.05, "max_velocity": 1.5}},
        }
    ],
    "RealtimeRequest": [{"kind": "realtime", "model": _MODEL, "step": 0.001, "seconds": 2.0}],
    "IdentifyRequest": [{"kind": "identify", "campaign": _CAMPAIGN, "model_kind": "nnoe"}],
}
