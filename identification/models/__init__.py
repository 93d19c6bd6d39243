"""Models of any kind, which give a force from a motion: what all kinds share."""

from identification.fmu_process.choice import Choice
from identification.models.compare import Comparison, compare, comparison_data, comparison_text
from identification.models.inputs import motion_from, motion_of
from identification.models.measures import Score, score, score_signals
from identification.models.modelfile import KINDS, Kind, load_model, model_from_json
from identification.models.motion import Motion
from identification.models.protocol import SimulationModel, TrainingRange
from identification.models.simulation import outside_training, simulate_run, with_simulation

__all__ = [
    "KINDS",
    "Choice",
    "Comparison",
    "Kind",
    "Motion",
    "Score",
    "SimulationModel",
    "TrainingRange",
    "compare",
    "comparison_data",
    "comparison_text",
    "load_model",
    "model_from_json",
    "motion_from",
    "motion_of",
    "outside_training",
    "score",
    "score_signals",
    "simulate_run",
    "with_simulation",
]
