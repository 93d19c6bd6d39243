"""Measured periodic tests analysed before any model, and the page that shows it."""

from identification.analysis.levels import AtLevel, LevelsFound, analyse_levels
from identification.analysis.of_runs import analyse_runs
from identification.analysis.page import analysis_html, write_analysis
from identification.analysis.words import analysis_data, analysis_text, levels_data, levels_text, refused_text

__all__ = [
    "AtLevel",
    "LevelsFound",
    "analyse_levels",
    "analyse_runs",
    "analysis_data",
    "analysis_html",
    "analysis_text",
    "levels_data",
    "levels_text",
    "refused_text",
    "write_analysis",
]
