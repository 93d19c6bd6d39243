"""Every number by which the search for missing effects decides, in one place.

Four groups. CHANCE: what noise alone may do. FORM: how far a real effect departs from the canonical curve of its
element, and how much a name must close. BUDGET: where the search stops for time; these only cost time. TEXT: which
words a report uses and which test it proposes; no name and no verdict depends on these.

Energies are whitened: squared force residual over the noise variance, so one unit for each sample of pure noise. The
*excess* of a fit is that energy less the number of samples. Where a number was read off kept outcomes, with no other
derivation, its comment says so.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True, kw_only=True)
class Chance:
    """From noise and degrees of freedom."""

    slack: float = 10.0
    """Difference of χ² that says nothing: one more parameter lowers χ² by more in 1 of 600 cases of pure noise (χ², one
    degree of freedom)."""

    sigmas: float = 5.0
    """Standard deviations beyond which an excess is no noise: by chance one case of three million."""

    floor_variance: float = 1.5
    """Variance of χ² over that with a known noise floor: 1 + 1/(P − 1), the floor being estimated from P = 3
    periods."""

    modelled_noise_error: float = 0.3
    """Share to which the noise is not known that a model makes of the displacement's noise. Read off kept outcomes."""

    near_floor: float = 0.35
    """Residual over noise: less is not told from noise on one run. It raises the rms by 6 %, which is what the floor of
    a run is known to. Read off kept outcomes."""

    at_noise: float = 0.02
    """Excess for each sample at which a fit has met the noise: 1 % of the rms. No other start or finer shape is
    tried."""

    unnoticed: float = 0.1
    """Share of the noise, rms, below which a force does not show: the least gap that first values are scaled with, and
    the least difference of two models on a test that tells them apart."""

    visible: float = 1e-3
    """Share of a signature, or of what the best record knows of a strength: less is rounding of the projection."""

    rank: float = 1e-7
    """Directions of a tangent space weaker than this share of the strongest are rounding: √ε of double precision,
    ×7."""

    unseen: float = 1e-6
    """Share of a tone that is left by a period that repeats it: rounding."""

    tone_power: float = 30.0
    """Power of a tone over the level beside it: by chance one line in 10¹² (the power of noise is exponential)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """How far a real effect is from its canonical curve, and what a name must close."""

    tolerance: float = 0.06
    """How far a real effect's curve departs from the canonical one, as a share of its own contribution: the spread
    between published forms of the same effect (three forms each of friction, gas spring, valve knee and hysteresis lie
    within). The same between two elements of which the one with fewer parameters is preferred: with 0.05 there, the
    names and verdicts of 90 kept cases were the same, and one confidence 0.03 higher."""

    alike_within: float = 1.25 * tolerance
    """The same where the simpler element is a case of the richer one, which can take any form. With 1.0 × tolerance the
    names of 80 kept cases were the same, one confidence fell from 0.97 to 0.89."""

    hidden: float = 0.5
    """Share of its force that the base may have imitated: a form error is not larger than that of 1/(1 − hidden)² = 4
    times the energy that the names close."""

    material: float = 0.003
    """Share of the rms force: a smaller discrepancy or tone matters to nobody. A convention, as the issue of a load
    cell's class."""

    closes: float = 0.4
    """Share of the excess that an element must close when it stands alone. Read off kept outcomes."""

    helps: float = 0.08
    """Share of the excess that one name of several must close at least. Read off kept outcomes."""

    explained: float = 0.1
    """Share of the base's excess that several names together may leave. Read off kept outcomes."""

    finer_shape_closes: float = 0.1
    """Share of the excess that a finer shape of one element must close."""

    disproportionate: float = 3.0
    """Factor beyond which two sizes do not go together: an element's force and the measured one (most of it then
    cancels what the base took on), a fitted parameter of the base and its given value, odd and even part of a curve."""

    minor: float = 0.3
    """Share that is a minor part of a whole: correlation of force and velocity without a clear sign; force that a model
    makes of noise; what one record knows of a strength; scatter of mean forces beside the gap; what another element may
    leave more than the best one, where none fits well. A convention. In the last place 0.4 changed no name in 80 kept
    cases; two confidences fell by 0.03 and 0.04."""

    most_effects: int = 4
    """Names at most: four elements on a base imitate nearly any gap."""

    min_confidence: float = 0.4
    """Confidence below which a name is not stated: of the few that were ever stated below it none was right."""

    sure: float = 0.9
    """Confidence below which the next test is worth its rig time."""

    hum_confidence: float = 0.99
    """Confidence in a tone that three or more runs share: chance is excluded by tone_power, wrong labels are not."""

    few_runs: int = 2
    """Training runs: with fewer, too much is unseen to say that nothing is missing."""

    enough_runs: int = 5
    """Runs that see an effect, of which one may be odd."""

    held_out: float = 0.25
    """Share of the runs that is held out where the user names none."""

    varying_temperature: float = 1.0
    """Span of temperature over all runs from which an effect of it can show, K."""

    tone_scatter: float = 0.35
    """Scatter of a tone's amplitude over the runs, relative, beyond which it is no property of the channel."""

    tone_runs: float = 0.75
    """Share of the runs in which a tone must stand out."""

    tone_cycles: float = 5.0
    """Cycles of a tone in the shortest run: with fewer it is an offset or a drift."""

    tone_left: float = 0.1
    """Share of a tone's amplitude that a record must keep beside the motion's own harmonics to tell it."""

    tone_lines: float = 2.0
    """Lines of the spectrum between a tone and a harmonic of a sine that is known to a line."""

    tone_nyquist: float = 0.95
    """Share of the Nyquist frequency below which a tone is sought."""

    one_sine: float = 0.9
    """Share of a motion's power in one line that makes it one sine."""

    build_up_span: tuple[float, float, float] = (1e-3, 0.1, 2.0)
    """Least, first and largest scale over which a finer shape may build up, of the lowest typical speed or
    build_up_travel: at zero its gradient vanishes, and a step that lands there would stay."""

    build_up_travel: float = 0.3
    """Travel over which a hysteresis may turn over, of the rms displacement."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """Where the search stops for time.

    With all of these relaxed at once (counts and factors doubled, shares and gains halved or the rest to 1 halved), the
    names, verdicts and confidences (to 0.02) of 14 kept cases were the same, at 2.8 times the processor time.
    """

    shortlist: int = 6
    """Elements that are tried at most in one step."""

    short_fit_records: int = 2
    """Records of a short fit, at least."""

    short_fit_share: float = 0.6
    """Share of the gap that the records of a short fit hold."""

    short_fit_iterations: int = 5
    """Iterations after which a candidate that is far behind the best is given up."""

    last_look_iterations: int = 2
    """Iterations on all records of a candidate that has been given up."""

    fit_iterations: int = 14
    """Iterations of a fit within the search."""

    final_iterations: int = 12
    """Iterations of the final model, which starts at the end of the search; its base takes base_iterations."""

    base_iterations: int = 8
    """Iterations of the base on the whole records, from where the search left it."""

    flat: float = 3e-4
    """Share of the misfit: an iteration that gains less decides nothing."""

    settling_s: float = 1.0
    """Motion before the window of a record that a signature is computed with, s."""

    far_behind: float = 5.0
    """Times the least excess: a candidate that leaves more after its short fit is given up."""

    half_as_good: float = 0.5
    """Share of a promise or of what the best has closed: what closes less has stuck, or will not lead."""

    continued_fits: int = 2
    """Short fits of one element that are continued, at most."""

    continued_within: float = 1.5
    """Times the least excess: short fits of one element within it are continued."""

    no_effect: float = 0.98
    """Share of the excess: a fit that leaves more has lost its element."""

    same_force: float = 0.01
    """Share of the excess: two fits whose forces differ by less are the same."""

    most_moves: int = 12
    """Moves of a search: names that still come and go then are not there."""

    tone_blocks: int = 256
    """Blocks into which a record is summed around a tone: within 30 lines of the centre nothing changes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Text:
    """The words of a report and the test that it proposes."""

    listed: float = 0.005
    """Confidence below which an alternative is not listed; most_listed at most are."""
    most_listed: int = 3

    coarse: float = 0.5
    """Numerical error over noise from which the report warns of it."""

    steady: float = 0.02
    """Swing of a current, as a share of it, below which it is constant; also the share of samples with a step in it."""

    same_frequency: float = 1.1
    """Largest over least ratio of rms velocity to rms displacement, over the runs: below it they have one frequency."""

    step: float = 0.1
    """Change of a current from sample to sample, as a share of its range, that is a step."""

    at_edge: float = 0.1
    """Distance from the end of a range, as a share of it, within which a region is just after an event."""

    narrow: float = 0.3
    """Width of a region, as a share of the range, below which it is a place in it, such as near zero velocity."""

    outer: float = 0.4
    """Share of a range, from each end, that is called low or high."""

    wide: float = 0.7
    """Width of a region, as a share of the range, above which it is all over the range."""

    loud: float = 0.15
    """Share of the gap from which a run is listed with a region."""

    between_runs: float = 0.2
    """Weight of a concentration over current or temperature: they mostly tell the runs apart."""

    least_samples: float = 0.02
    """Share of the samples: a region is not called more concentrated than this."""

    most_regions: int = 4
    """Regions in a report."""

    most_terms: int = 4
    """Terms of an equation for a remainder."""

    term_pays: float = 0.03
    """Share of the remainder on runs left out that one more term must explain."""

    term_own: float = 0.05
    """Share of a term that the model may not absorb, at least."""

    term_new: float = 0.1
    """Share of a term that the terms before it leave, at least."""

    equation_worth: float = 0.15
    """Share that an equation must explain to be written down."""

    curve_worth: float = 0.25
    """Share of a remainder that a curve over velocity or displacement must hold to be mentioned."""

    same_motion: float = 0.05
    """Relative difference of two motions in every respect below which they are one test."""

    least_test_s: float = 4.0
    """Motion of a test, s: a shorter one costs as much, for its fades and settling."""

    short_test_s: float = 15.0
    """Motion of a test where nothing is suspected, s, at most."""

    longest_test_s: float = 60.0
    """Motion of any test, s, at most."""


CHANCE: Final = Chance()
FORM: Final = Form()
BUDGET: Final = Budget()
TEXT: Final = Text()
