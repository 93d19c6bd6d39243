"""Vehicles that hold dampers of any kind, their motion over a ground, and what studies make of it."""

from identification.studies.vehicle.answer import Answer, Curve, Figure, Study, study_data, study_text
from identification.studies.vehicle.bogie import Bogie, RailBogie
from identification.studies.vehicle.bogie_study import OnRail, Stability, bogie_study, stability
from identification.studies.vehicle.choice import VEHICLES, check_vehicle_study, setting_of, vehicle_study
from identification.studies.vehicle.comfort import Comfort, comfort
from identification.studies.vehicle.fmu_vehicle import FmuVehicle, FmuWiring, open_vehicle
from identification.studies.vehicle.linear import LinearVehicle, Output
from identification.studies.vehicle.own import OwnVehicle
from identification.studies.vehicle.own_study import OnOwn, check_own_study, own_study
from identification.studies.vehicle.page import write_study
from identification.studies.vehicle.protocol import Ground, Leap, Vehicle, VehicleSteps
from identification.studies.vehicle.quarter_car import QuarterCar, quarter_car
from identification.studies.vehicle.ride import Control, Held, Ride, left_training, ride
from identification.studies.vehicle.road_study import OnRoad, road_study
from identification.studies.vehicle.seat import Seat, seat_suspension
from identification.studies.vehicle.seat_study import OnSeat, seat_study
from identification.studies.vehicle.skyhook import Skyhook
from identification.studies.vehicle.transmissibility import Transmissibility, by_multisine, stepped_sine
from identification.studies.vehicle.worth import Worth, without, worth

__all__ = [
    "VEHICLES",
    "Answer",
    "Bogie",
    "Comfort",
    "Control",
    "Curve",
    "Figure",
    "FmuVehicle",
    "FmuWiring",
    "Ground",
    "Held",
    "Leap",
    "LinearVehicle",
    "OnOwn",
    "OnRail",
    "OnRoad",
    "OnSeat",
    "Output",
    "OwnVehicle",
    "QuarterCar",
    "RailBogie",
    "Ride",
    "Seat",
    "Skyhook",
    "Stability",
    "Study",
    "Transmissibility",
    "Vehicle",
    "VehicleSteps",
    "Worth",
    "bogie_study",
    "by_multisine",
    "check_own_study",
    "check_vehicle_study",
    "comfort",
    "left_training",
    "open_vehicle",
    "own_study",
    "quarter_car",
    "ride",
    "road_study",
    "seat_study",
    "seat_suspension",
    "setting_of",
    "stability",
    "stepped_sine",
    "study_data",
    "study_text",
    "vehicle_study",
    "without",
    "worth",
    "write_study",
]
