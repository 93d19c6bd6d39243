"""Every number by which the search for missing effects decides, in one place.

Four groups. CHANCE: what noise alone may do. FORM: how far a real effect departs from the canonical curve of its
element, and how much a name must close. BUDGET: where the search stops for time; these only cost time. TEXT: which
words a report uses and which test it proposes; no name and no verdict depends on these.

Energies are whitened: squared force residual over the noise variance, so one unit for each sample of pure noise. The
*excess* of a fit is that energy less the number of samples. Where a number was read off kept outcomes, with no other
derivation, its comment says so. What half and double of a number do is said for each; for given cases
`python -m benchmarks.explain.sensitivity` tells which names and verdicts they change.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True, kw_only=True)
class Chance:
    """From noise and degrees of freedom."""

    slack: float = 10.0
    """Difference of χ² that says nothing: one more parameter lowers χ² by more in 1 of 600 cases of pure noise (χ², one
    degree of freedom). Half: 1 in 40; double: 1 in 130 000. Names, verdicts and confidences of 12 kept cases are the
    same with both."""

    sigmas: float = 5.0
    """Standard deviations beyond which an excess is no noise: by chance one case of three million. Half: one of 160;
    double: gaps twice as large stay unseen."""

    floor_variance: float = 1.5
    """Variance of χ² over that with a known noise floor: 1 + 1/(P − 1), the floor being estimated from P = 3 periods.
    Half and double: the least excess that is no noise is 0.7 and 1.4 times as large."""

    modelled_noise_error: float = 0.3
    """Share to which the noise is not known that a model makes of the displacement's noise. Half and double: so is the
    least excess that is no noise, where a model makes most of it. Read off kept outcomes."""

    near_floor: float = 0.35
    """Residual over noise: less is not told from noise on one run. It raises the rms by 6 %, which is what the floor of
    a run is known to. Two models that differ by less on a test are not told apart by it. Half: 1.5 %, and more gaps are
    explained only in part; double: 22 %. Read off kept outcomes."""

    at_noise: float = 0.02
    """Excess for each sample that does not show: 1 % of the rms. A fit has met the noise there, and no other start or
    finer shape is tried; its root is the least gap that first values are scaled with. Half: 0.5 % of the rms, and more
    starts are tried; double: 2 %."""

    visible: float = 1e-3
    """Share of a signature, of what the best record knows of a strength, or of the scale of a finer shape: less is
    rounding of the projection. Half and double change nothing: what is seen lies far above."""

    rounding: float = 1e-7
    """Share below which a direction of a tangent space, or what is left of a tone, is rounding: √ε of double precision,
    ×7. Half and double change nothing: a direction that the data know lies far above."""

    tone_power: float = 30.0
    """Power of a tone over the level beside it: by chance one line in 10¹² (the power of noise is exponential). Half:
    one in 3·10⁶; double: a tone must be 1.4 times as large to be seen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """How far a real effect is from its canonical curve, and what a name must close."""

    tolerance: float = 0.06
    """How far a real effect's curve departs from the canonical one, as a share of its own contribution: the spread
    between published forms of the same effect (three forms each of friction, gas spring, valve knee and hysteresis lie
    within). The same between two elements of which the one with fewer parameters is preferred. A friction that falls by
    less is taken not to fall. Half: of two names that fit alike the one with more parameters is chosen more often, and
    more gaps are explained only in part; double: a real fall or bend within 12 % gets the simpler name."""

    build_up: float = tolerance / 3.0
    """The same between a friction that falls with speed and one that does not: how friction builds up is free in both,
    and what is left to differ is the fall. Also the offset of the branches of a hysteresis, over their height, below
    which it is a plain curve. Half: a friction of tanh form, without a fall, is named Stribeck friction; three times as
    much, the whole tolerance: the names of 80 kept cases are the same."""

    imitated: float = 2.0
    """Force of an effect over what its name closes, at most: the base may have imitated the other half. A form error is
    not larger than that of 4 times the energy that the names close. Half: more gaps are explained only in part; double:
    an element that only trades places with the base may leave four times as much."""

    material: float = 0.003
    """Share of the force's standard deviation: a smaller discrepancy or tone matters to nobody. A preload does not
    count: a stop of 1 % of the motion's force is seen beside it. A convention, as the issue of a load cell's class.
    Half and double: the least gap that gets a name, in runs with little noise."""

    closes: float = 0.4
    """Share of the excess that a search from another start, or without the odd run, must close more to count instead.
    Half: more answers are those of another start; double: hardly any is. Read off kept outcomes."""

    helps: float = 0.08
    """Share of the excess that a name, or a finer shape, must close at least; a fit that closes less has lost its
    element. Half: more small names beside large ones; double: a third effect of less than a sixth of the gap gets no
    name. Read off kept outcomes."""

    explained: float = 0.1
    """Share of the base's excess below which names explain the gap: only then other choices of single names are tried,
    and only such a search may count instead. Half and double: these are fewer and more. Read off kept outcomes."""

    loop: float = 0.2
    """Share of its slope that a hysteresis loses within half the stroke, at least: with less it is a spring within the
    accuracy of a fit. Half: a spring is named a hysteresis sooner; double: the reverse. Read off kept outcomes."""

    contact: float = 0.2
    """Share of a rigid contact's stiffness (of it 6e6 N/m) beyond which a compliance is that of the contact. Half:
    stiff bushes get no name; double: a contact is named a compliance. Read off kept outcomes."""

    seat: float = 0.05
    """Share of the energy of a play that the stiffness of its contact may close without a name of its own: the ways in
    which the halves of a joint meet differ by as much. Half and double: a stiffness beside a play is named from half or
    twice that energy. Read off kept outcomes."""

    gone: float = 0.07
    """Share of the rms force that presses half of some free air away: with less it is a joint whose halves meet softly.
    Of 19 simulated machines with less, fitted with air, 18 have a play; of 22 with more 20 hold air. Half: plays are
    called air; double: air that little pressure holds is called a play."""

    play: float = 0.1
    """Share of the deflection of a contact under the rms force: a smaller gap does not show beside the deflection. Half
    and double: the least play that is named so, and not a compliance."""

    disproportionate: float = 3.0
    """Factor beyond which two sizes do not go together: an element's force and the measured one (most of it then
    cancels what the base took on), a fitted parameter of the base and its given value, what a bend takes from the slope
    of the force and that slope, odd and even part of a curve, the speed over which a friction builds up and the lowest
    typical one. Half: large effects on a base that is off by a third are refused; double: elements are named that
    cancel the base. A convention."""

    minor: float = 0.3
    """Share that is a minor part of a whole: correlation of force and velocity without a clear sign; force that a model
    makes of noise; scatter of mean forces beside the gap, and beside a
    constant force; noise of a current beside its mean; scatter of a tone's
    amplitude, and the runs without it; what another element may leave more than the best one, where none fits well; a
    lag beside a dead time (its rise, 10 to 90 %, is then two thirds of that); travel over which a hysteresis turns
    over, of the rms displacement; what a run leaves upside down, of what it leaves as it is; what a name closes of a
    rest that lies within the form of others, where it leads to none that count. Half and double: as if the
    scatter of each of these were known twice or half as well. A convention."""

    most_effects: int = 4
    """Names at most: four elements on a base imitate nearly any gap. Half: no set of three; double: sets for which the
    search takes minutes."""

    min_confidence: float = 0.55
    """Confidence below which a name is not stated: half, and what the table is off by on names that it was not fitted
    to. Of the names in docs/explain.md 94 % of those stated are right; 0.3 and 0.7: 9 % more and 4 % fewer are stated,
    89 and 95 % of them right."""

    held_out: float = 0.25
    """Share of the runs that is held out where the user names none. Half and double: of eight runs one and four."""

    varying_temperature: float = 1.0
    """Span of temperature over all runs from which an effect of it can show, K. The force of a damper changes by some
    tenths of a per cent a kelvin, which is what is material. Half and double: the least span in which a fade is
    sought."""

    tone_left: float = 0.1
    """Share of a tone's amplitude that a record must keep beside the motion's own harmonics to tell it; of a motion's
    power that is beside its strongest line where it is one sine. Half and double: how near to a harmonic a tone is
    still sought."""

    clocks: float = 0.002
    """Share by which the frequency of one tone may differ between two runs: the sample clocks of two recorders by 0.1 %
    each. A supply of 50 Hz keeps to as much. Half: of runs with such clocks one may lose the tone; double: what is near
    it in the residual of a long run may take its place."""

    tone_lines: float = 2.0
    """Lines of the spectrum between a tone and what is known to a line: the mean, a harmonic of a sine, the Nyquist
    frequency. The main lobe of a rectangular window is one line wide on each side. Half: the skirt of a harmonic may be
    a tone; double: tones within four lines of one are not sought."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Budget:
    """Where the search stops for time. With all of these relaxed at once (counts and factors doubled, shares and gains
    halved or the rest to 1 halved), the names, verdicts and confidences (to 0.02) of 14 kept cases were the same, at
    2.8 times the processor time. Measured before some of these were merged, always to the value that spends more."""

    samples: int = 5_000
    """Samples of all records together beyond which a search uses a piece of each record without a period. With 16 000,
    52 machines took 1.1 times the processor time, and 68 instead of 70 of 75 names were right."""

    odd_share: float = 0.5
    """Share of what the names leave that one run must hold to be tried as the odd one of its set. It is left out only
    where the names then explain all others."""

    shortlist: int = 10
    """Elements that are tried at most in one step. With 6, a twin tube's valve and air were not found, and 90 machines
    took as long: what is far behind after its short fit costs little."""

    short_fit_records: int = 2
    """Records of a short fit, at least."""

    short_fit_share: float = 0.6
    """Share of the gap that the records of a short fit hold."""

    short_fit_iterations: int = 5
    """Iterations after which a candidate that is far behind the best is given up."""

    last_look_iterations: int = 2
    """Iterations on all records of a candidate that has been given up."""

    fit_iterations: int = 14
    """Iterations of a fit within the search, and of those after it, which start at its end."""

    flat: float = 3e-4
    """Share of the misfit: an iteration that gains less decides nothing."""

    settling_s: float = 1.0
    """Motion before the window of a record that a signature is computed with, s."""

    far_behind: float = 5.0
    """Times the least excess: a candidate that leaves more after its short fit is given up. Times that of a name whose
    values are refused, or the error of form: a simpler name that leaves more does not take its place. It was found
    on swaps that left 528 and 1 200 times as much, which half and double refuse as well."""

    half_as_good: float = 0.5
    """Share of a promise or of what the best has closed: what closes less has stuck, or will not lead. A short fit that
    leaves more than the best of its element over this share is not continued."""

    continued_fits: int = 2
    """Short fits of one element that are continued, at most."""

    same_force: float = 0.01
    """Share of the excess: two fits whose forces differ by less are the same."""

    most_moves: int = 12
    """Moves of a search: names that still come and go then are not there."""

    build_up: float = 0.1
    """First value of a finer shape, of the lowest typical speed or of the travel that is a minor part of the stroke: at
    zero its gradient vanishes."""

    tone_blocks: int = 256
    """Blocks into which a record is summed around a tone: within 30 lines of the centre nothing changes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Text:
    """The words of a report and the test that it proposes."""

    sure: float = 0.9
    """Confidence below which the next test is worth its rig time."""

    few_runs: int = 2
    """Training runs: with fewer, too much is unseen not to propose another."""

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

    even: float = 1.5
    """Share of the gap over share of the samples below which a region is called even: it points nowhere."""

    unknown: float = 100.0
    """Standard deviation of a parameter over its value from which the report says that the runs do not determine it."""

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

    corner_m_s2: float = 30.0
    """Acceleration in the rounded corners of a triangle: half of what a servo-hydraulic rig of 25 kN declares."""


CHANCE: Final = Chance()
FORM: Final = Form()
BUDGET: Final = Budget()
TEXT: Final = Text()
