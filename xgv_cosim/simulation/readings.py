"""What one bound vehicle knows of itself, read from its row when a report is made of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.fleet_columns import Motion
from xgv_cosim.parameters import ParameterColumns
from xgv_cosim.plant.imperfections import measured_speed_mps
from xgv_cosim.plant.wheels import wheel_speeds_mps
from xgv_cosim.simulation.drivetrain import reading_of
from xgv_cosim.vehicles.base import VehicleModeReport

if TYPE_CHECKING:
    from collections.abc import Mapping

    from jaus.address import ComponentId, JausAddress
    from jaus.component import ComponentStatus
    from xgv_cosim.commands import Signals
    from xgv_cosim.observation import DeviceReading
    from xgv_cosim.simulation.binding import BoundVehicle
    from xgv_cosim.simulation.state import RunState


class Readings:
    """Implements ``vehicles.base.VehicleReadings`` for one bound vehicle."""

    def __init__(self, state: RunState, vehicle: BoundVehicle) -> None:
        self._state = state
        self._vehicle = vehicle
        self._row = slice(vehicle.slot, vehicle.slot + 1)
        self._parameters = ParameterColumns(
            *(np.array(column[self._row]) for column in state.fleet.parameters)
        )

    @property
    def time_s(self) -> float:
        """Return the simulation time."""
        return self._state.now_s

    @property
    def speed_mps(self) -> float:
        """Return the measured forward speed (XGV-03)."""
        fleet, row = self._state.fleet, self._row
        speed = fleet.motion.speed_mps[row]
        tick = self._state.clock.tick
        return float(measured_speed_mps(speed, self._parameters, fleet.draw_key[row], tick)[0])

    @property
    def curvature_per_m(self) -> float:
        """Return the curvature of the rear axle's path, positive counter-clockwise."""
        return float(self._state.fleet.motion.curvature_per_m[self._vehicle.slot])

    @property
    def wheel_speeds_mps(self) -> tuple[float, float, float, float]:
        """Return the speeds of front left, front right, rear left and rear right wheel."""
        motion = Motion(*(column[self._row] for column in self._state.fleet.motion))  # type: ignore[arg-type]
        front_left, front_right, rear_left, rear_right = wheel_speeds_mps(motion, self._parameters)
        return float(front_left[0]), float(front_right[0]), float(rear_left[0]), float(rear_right[0])

    @property
    def throttle(self) -> float:
        """Return the throttle in effect, share 0 to 1."""
        return float(self._state.fleet.motion.throttle[self._vehicle.slot])

    @property
    def brake(self) -> float:
        """Return the brake effort in effect, share 0 to 1."""
        return float(self._state.fleet.motion.brake[self._vehicle.slot])

    @property
    def steering(self) -> float:
        """Return the share of the greatest road-wheel angle, positive counter-clockwise."""
        fleet, slot = self._state.fleet, self._vehicle.slot
        return float(fleet.motion.steer_rad[slot] / fleet.parameters.max_steer_rad[slot])

    @property
    def devices(self) -> DeviceReading:
        """Return gear, engine and parking brake."""
        return reading_of(self._state.fleet, self._vehicle.slot)

    @property
    def signals(self) -> Signals:
        """Return lights and horn as the computer has them."""
        return self._vehicle.endpoint.signals

    @property
    def errors(self) -> frozenset[int]:
        """Return the codes that are raised, warnings included."""
        return self._vehicle.endpoint.errors

    @property
    def vehicle_mode(self) -> VehicleModeReport:
        """Return the fields of Report Vehicle Mode, all unknown where the vehicle has no such report."""
        fleet, slot = self._state.fleet, self._vehicle.slot
        words = (fleet.control_mode, fleet.ready_mode, fleet.safety_mode, fleet.partial_mode)
        values = (int(word[slot]) for word in (*words, fleet.safety_devices))
        report = self._vehicle.binding.profile.vehicle_mode_report(*values)
        return VehicleModeReport(0, 0, 0, 0, 0, 0) if report is None else report

    @property
    def secondary_status(self) -> int:
        """Return the vehicle-specific word of Report Component Status (XGV-46)."""
        fleet, slot = self._state.fleet, self._vehicle.slot
        partial, devices = int(fleet.partial_mode[slot]), int(fleet.safety_devices[slot])
        return self._vehicle.binding.profile.secondary_status(partial, devices)

    @property
    def component_status(self) -> Mapping[ComponentId, ComponentStatus]:
        """Return the status of each component that has one of its own."""
        return self._vehicle.endpoint.component_status

    @property
    def component_controller(self) -> Mapping[ComponentId, JausAddress | None]:
        """Return who controls each of them, None: nobody."""
        return self._vehicle.endpoint.component_controller

    @property
    def component_authority(self) -> Mapping[ComponentId, int]:
        """Return with which authority each of them is controlled, 0: nobody controls it."""
        return self._vehicle.endpoint.component_authority
