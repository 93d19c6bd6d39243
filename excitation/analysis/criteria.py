"""Every number that decides in the analysis of a periodic test."""

from __future__ import annotations

__all__ = [
    "ALIKE",
    "CONFIDENCE",
    "CORRECTED",
    "FEW_LINES",
    "HEAD",
    "HOLDS_MOST",
    "LEVEL_ALIKE",
    "LINES_OF_A_SEGMENT",
    "LOCAL",
    "MOST_SEGMENTS",
    "POOLED",
    "REACH",
    "SEEN",
    "SIGMAS",
    "SMALL",
    "SPOILED",
    "TOGETHER",
    "UNSETTLED",
    "UNSETTLED_HEAD",
]

# Probability of every bound. 0.99 widens them by a third.
CONFIDENCE = 0.95
# Standard deviations about its mean that hold a normal number with this probability.
SIGMAS = 1.959963984540054
# A line of an input is excited where it has this share of the amplitude of the highest line near it. Rigs distort by
# 0.1 … 3 %; designs change by a factor of 2 within that distance at most. The same lines are found from 0.05 to 0.3.
LOCAL = 0.1
# Near: within this share of the line's number, and 8 lines at least. Half of it loses the neighbours of log-spaced
# lines; double makes a road spectrum fall below LOCAL.
TOGETHER = 0.25
# Standard deviations of its noise by which an excited line stands out: by chance 5 in 10 million lines do. At 2.5 noise
# is taken for lines at the end of a steep spectrum; at 10 usable lines are lost.
SEEN = 5.0
# Distortion is looked for up to so many times the highest excited line: products of the fifth order end there. Beyond,
# what a damper adds is mostly below its noise; 3 loses a tenth of a friction's power, 10 adds noise alone.
REACH = 5
# Detection lines for each straight piece of a level over frequency. 3 doubles the variance of the level; 12 smooths
# over a resonance of the level that is narrower than 50 lines.
LINES_OF_A_SEGMENT = 6
# Pieces at most: a hundredth of the band is resolved. Half smooths more; double takes four times as long where a period
# has 100 000 lines.
MOST_SEGMENTS = 100
# Complex degrees of freedom over which a variance is averaged with those of neighbouring lines, at least: its square
# root is then known to a tenth. Half: to 16 %; double: half the resolution over frequency.
POOLED = 20
# Times the variance between later periods by which an unsettled period differs from them. 1.5 takes coloured noise for
# a transient, 4 leaves one as large as the noise.
UNSETTLED = 2.0
# A transient is highest at the start: times by which the first part of the difference exceeds the rest.
UNSETTLED_HEAD = 2.0
# That first part, as a share of the period. A damper forgets within 0.1 s to 1 s, of periods of 2 s to 10 s.
HEAD = 0.125
# Two runs with spectra whose correlation exceeds this are one realisation: those of different phases have 1/√lines, at
# most 0.5 for 15 lines; those of the same phases differ by the rig's repeatability, 1 % or less.
ALIKE = 0.9
# Ratio of two rms inputs within which runs are of one level: realisations that were designed one by one each reach
# their own peak, with rms values that differ by up to 20 % where lines are many. 1.1 takes these apart, 1.6 mixes
# levels of a campaign.
LEVEL_ALIKE = 1.3
# Share of a found distortion that the rig's own input on the detection lines may make before it is told.
CORRECTED = 0.3
# Excited lines below which bounds say nothing: products of so few lines are not spread evenly over lines.
FEW_LINES = 10
# Equivalent number of driven lines, (Σ|GU|²)²/Σ|GU|⁴, below which the same holds: 92 % of the levels of a road spectrum
# (3.4 lines) lie within bounds of 95 %, 95 % of those of a velocity spectrum (6).
HOLDS_MOST = 5.0
# Share of the lines that a channel leaves out from which another one that excites them is told of. Two bands of
# random odd lines differ in the last group of the shorter one, by a line or two; a current on all lines excites all.
SPOILED = 0.1
# Power of a line over that of all: below it is rounding.
SMALL = 1e-20
