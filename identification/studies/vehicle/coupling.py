"""The forces of dampers and the motion of the vehicle at the end of a step, brought to agree."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from identification.models.stepping import Moment, Stepper, foresees
from identification.studies.vehicle.protocol import Leap

Floats = NDArray[np.float64]

# Share of the highest force so far by which a force and what its motion asks for may differ. At 1e-4 the answer of a
# vehicle changes in its fifth digit; at 1e-9 each step costs one more evaluation.
_AGREE = 1e-7
_LEAST = 1e-6  # N, the same while no force has been there
_TRIES = 60  # of one damper at one sample: bisection of a jump to rounding takes as many
_ROUNDS = 40  # over the dampers of a vehicle
_STILL = 1e-8  # m/s: two stuck dampers beside each other share their force in many ways, with the same motion
_ROUNDED = 10.0  # times the tolerance: two rounds that differ by less agree; each closes its bracket to the tolerance


def moment(motion: Floats, current: float, temperature: float) -> Moment:
    """The inputs of a damper from its motion (3,)."""
    x, v, a = motion.tolist()
    return Moment(x, v, a, current, temperature)


class Coupling:
    """Forces F with F = damper(motion(F)), sample by sample.

    A force that pulls shortens the damper, which lowers what the damper gives: damper(motion(F)) falls with F, and the
    solution lies between F and damper(motion(F)) for every F. From there a secant, held within that bracket; where the
    force jumps (dry friction), the bracket closes on the force that holds the damper at rest.
    """

    def __init__(self, steppers: Sequence[Stepper], temperature: float) -> None:
        """Dampers that have been started, at a temperature in °C."""
        self._steppers, self._temperature = steppers, temperature
        self._slopes = [0.0] * len(steppers)  # of damper(motion(F)) by F, as the last sample had it
        self._highest = 0.0
        self.missed = np.zeros(len(steppers))  # sum of squares, N², by which guesses were off

    def settle(self, leap: Leap, forces: Floats, currents: Floats) -> tuple[Floats, bool]:
        """The forces at the end of a step, (D,), N, and whether they were met; the dampers go on to there."""
        forces = forces.copy()
        tolerance = max(_AGREE * self._highest, _LEAST)
        met, rates = False, np.full(forces.size, np.inf)
        for _ in range(_ROUNDS if forces.size > 1 else 1):
            moved = [self._solve(k, leap, forces, currents, tolerance) for k in range(forces.size)]
            met = all(done for done, _ in moved)
            before, rates = rates, leap.motions(forces)[:, 1]
            still = float(np.max(np.abs(rates - before))) <= _STILL
            if still or max(change for _, change in moved) <= _ROUNDED * tolerance:
                break
        else:
            met = met and forces.size == 1
        motions = leap.motions(forces)
        for k, one in enumerate(self._steppers):
            answer = one.advance(moment(motions[k], float(currents[k]), self._temperature))
            if not foresees(one):
                self.missed[k] += (answer - forces[k]) ** 2
                forces[k] = answer
        self._highest = max(self._highest, float(np.max(np.abs(forces))))
        return forces, met

    def _solve(self, k: int, leap: Leap, forces: Floats, currents: Floats, tolerance: float) -> tuple[bool, float]:
        """Solves for the force of damper k beside the others, into `forces`; success, and by how much it moved."""
        one, current, first = self._steppers[k], float(currents[k]), float(forces[k])

        def given(force: float) -> float:
            forces[k] = force
            return one.force(moment(leap.motions(forces)[k], current, self._temperature))

        force, slope, done = _agreed(given, first, self._slopes[k], tolerance)
        forces[k], self._slopes[k] = force, slope
        return done, abs(force - first)


def _agreed(given: Callable[[float], float], force: float, slope: float, tolerance: float) -> tuple[float, float, bool]:
    """The F with given(F) = F of a falling function, its slope there, and whether it was met."""
    low, high, last, last_miss = -np.inf, np.inf, force, 0.0
    for tried in range(_TRIES):
        answer = given(force)
        miss = answer - force
        if abs(miss) <= tolerance or (high - low) <= tolerance:
            return (force if high - low <= tolerance else answer), slope, True
        low, high = (max(low, force), high) if miss > 0.0 else (low, min(high, force))
        # What the damper gives there bounds the solution on the other side.
        low, high = (low, min(high, answer)) if miss > 0.0 else (max(low, answer), high)
        if low > high:  # the damper gives more where it is shortened: no bracket
            low, high = -np.inf, np.inf
        if tried and force != last:
            slope = min((miss - last_miss) / (force - last) + 1.0, 0.0)
        last, last_miss = force, miss
        step = force + miss / (1.0 - slope)
        stuck = tried > 3 and tried % 2 == 1
        force = 0.5 * (low + high) if (stuck or not low < step < high) and high - low < np.inf else step
    return force, slope, False
