"""The simulation: the order of a step, and what happens between the stages."""

from __future__ import annotations

from xgv_cosim.simulation.binding import Binding, BoundVehicle
from xgv_cosim.simulation.journal import Journal, Observer
from xgv_cosim.simulation.loop import Simulation
from xgv_cosim.simulation.vehicle import VehicleHandle

__all__ = ["Binding", "BoundVehicle", "Journal", "Observer", "Simulation", "VehicleHandle"]
