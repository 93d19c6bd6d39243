"""A vehicle with dampers: exact where it is linear, and refused in one line where it can't be driven."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from identification.errors import DataError, ModelError, SimulationError
from identification.models import SimulationModel, load_model
from identification.models.stepping import Moment, Stepper
from identification.physical.literature import literature
from identification.physical.model import Model, element
from identification.studies.vehicle import Ground, Held, QuarterCar, Ride, quarter_car, ride
from tests.identification.polynomial import Polynomial

DT = 1e-3


def sine(frequency: float, amplitude: float = 0.01, seconds: float = 4.0) -> Ground:
    w, t = 2.0 * np.pi * frequency, np.arange(round(seconds / DT)) * DT
    x, v = amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)
    return Ground(dt=DT, x=x[:, None], v=v[:, None], a=(-(w**2) * x)[:, None])


def viscous(c: float) -> Model:
    return Model(name="viscous", elements=(element("viscous_damping", {"c": c}),))


def driven(model: SimulationModel, ground: Ground) -> Ride:
    return ride(quarter_car(), {"suspension": model}, ground, control=Held(0.2))


@pytest.mark.parametrize(("c", "frequency"), [(1500.0, 1.0), (2500.0, 5.0), (4000.0, 10.0)])
def test_with_a_viscous_damper_the_quarter_car_answers_as_its_transfer_function(c: float, frequency: float) -> None:
    car, ground = quarter_car(), sine(frequency, seconds=6.0)
    found = ride(car, {"suspension": viscous(c)}, ground)
    late = slice(-round(2.0 / DT), None)
    turn = np.exp(-2j * np.pi * frequency * found.time[late])
    for name in car.outputs:
        answer = 2j * np.mean(found.outputs[name][late] * turn) / 0.01
        exact = car.transfer(name, np.array([frequency]), np.array([c]))[0]
        assert abs(answer - exact) <= 3e-3 * abs(exact), name


def test_a_damper_far_too_stiff_for_explicit_steps_stays_stable_and_locks_the_suspension() -> None:
    found = driven(viscous(1e7), sine(3.0))
    assert found.loose == 0
    assert np.ptp(found.x) < 1e-2 * np.ptp(found.outputs["body"])


def test_dry_friction_that_exceeds_the_force_on_it_holds_the_suspension_at_rest() -> None:
    dry = Model(name="dry", elements=(element("coulomb_friction", {"f_c": 1e5}),))
    found = driven(dry, sine(3.0, 0.002, 1.0))
    assert np.max(np.abs(found.v)) < 1e-5
    assert np.max(np.abs(found.force)) < 1e5


@pytest.mark.parametrize("name", ["Bingham", "LuGre", "hyperbolic tangent", "enriched Maxwell"])
def test_the_forces_agree_with_the_motion_at_every_sample(name: str) -> None:
    found = driven(literature(name), sine(2.0))
    assert found.loose == 0
    body = 300.0 * found.outputs["body_acceleration"] + 17e3 * found.x[:, 0] + found.force[:, 0]
    assert np.max(np.abs(body)) < 1e-6 * np.max(np.abs(found.force))


def test_the_energy_that_the_damper_takes_is_what_the_ground_gives() -> None:
    found = driven(literature("Bingham"), sine(2.0, seconds=8.0))
    cycle = slice(-round(0.5 / DT) * 4 - 1, None)
    taken = np.trapezoid((found.force * found.v)[cycle, 0], dx=DT)
    pulled = np.trapezoid((found.outputs["tyre_force"] * sine(2.0, seconds=8.0).v[:, 0])[cycle], dx=DT)
    wheel = np.gradient(found.outputs["wheel"], DT)
    tyre = np.trapezoid(100.0 * (sine(2.0, seconds=8.0).v[:, 0] - wheel)[cycle] ** 2, dx=DT)
    assert taken + tyre == pytest.approx(pulled, rel=2e-3)


def test_what_cannot_be_driven_is_refused_before_the_work() -> None:
    ground, car = sine(1.0), quarter_car()
    with pytest.raises(DataError, match="needs a current"):
        ride(car, {"suspension": load_model("examples/models/mr.json")}, ground)
    with pytest.raises(DataError, match="has the dampers suspension"):
        ride(car, {"yaw": viscous(1.0)}, ground)
    with pytest.raises(DataError, match="can't be taken from sample to sample"):
        ride(car, {"suspension": Polynomial(name="p", coefficients=(0.0, 1.0), trained_m_s=1.0)}, ground)
    with pytest.raises(ModelError, match="body_mass_kg is 0"):
        QuarterCar(body_mass_kg=0.0)


def test_a_vehicle_that_runs_away_is_named_with_its_time() -> None:
    class Pushes(Polynomial):
        """A model of the user's own: it pushes instead of damping."""

        def stepper(self, dt: float) -> Stepper:
            return Pushing(dt)

    with pytest.raises(SimulationError, match=r"quarter car runs away.*unstable"):
        driven(Pushes(name="p", coefficients=(0.0, -2000.0), trained_m_s=1.0), sine(1.0, seconds=20.0))


@dataclass
class Pushing:
    dt: float

    def start(self, at: Moment) -> float:
        return self.force(at)

    def force(self, at: Moment) -> float:
        return -2000.0 * at.v

    def advance(self, at: Moment) -> float:
        return self.force(at)
