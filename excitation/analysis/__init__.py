"""What a periodic test says before any model: linear approximation, distortion, noise, time variation."""

from excitation.analysis.analyse import analyse
from excitation.analysis.designed import designed_lines
from excitation.analysis.levels import Level
from excitation.analysis.measurement import Measurement, Realisation
from excitation.analysis.result import Analysis, Levels, LineLevels, Played, Response
from excitation.analysis.seen_lines import SeenLines, excited_in, seen_lines
from excitation.analysis.spoiled import spoiled_in, spoiled_lines
from excitation.analysis.variation import Trend, Variation

__all__ = [
    "Analysis",
    "Level",
    "Levels",
    "LineLevels",
    "Measurement",
    "Played",
    "Realisation",
    "Response",
    "SeenLines",
    "Trend",
    "Variation",
    "analyse",
    "designed_lines",
    "excited_in",
    "seen_lines",
    "spoiled_in",
    "spoiled_lines",
]
