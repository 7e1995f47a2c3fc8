"""The reference stack through wrench efforts: the same driving, with throttle, brake and steering of its own.

It asks for the Primitive Driver alone and repeats its efforts at every step, as public clients of the
open loop do (XGV-18, XGV-59). Speed is held by a PI controller on top of a map of the car's forces;
steering follows the relation of the public clients, ``curvature = tan(phi / (1 + v^2 k)) / L`` (XGV-62).
"""

from __future__ import annotations

import math

from jaus.address import JausAddress
from xgv_cosim.autonomy.driving import RouteDriving, Wish
from xgv_cosim.autonomy.session import DRIVES, open_loop_session
from xgv_cosim.autonomy.settings import ReferenceStackSettings
from xgv_cosim.commands import WrenchEffort
from xgv_cosim.endpoint import StackMessage
from xgv_cosim.observation import Observation
from xgv_cosim.parameters import GRAVITY_MPS2, VehicleParameters

GAIN_PER_S = 1.0
INTEGRAL_GAIN_PER_S2 = 0.3
MOST_ERROR_MPS = 0.8
"""The wanted speed runs ahead of the car, or behind it, by no more."""
MOST_INTEGRAL_M = 3.0
STANDS_MPS = 0.3
HOLDING_BRAKE = 0.3


def steering_share(curvature_per_m: float, speed_mps: float, car: VehicleParameters) -> float:
    """Return the steering effort for a curvature, -1 to 1, positive to the left (XGV-62)."""
    stretch = 1.0 + speed_mps * speed_mps * car.understeer_rad_s2_per_m / car.wheelbase_m
    share = math.atan(curvature_per_m * car.wheelbase_m) * stretch / car.max_steer_rad
    return min(1.0, max(-1.0, share))


def pedal_shares(tyre_mps2: float, speed_mps: float, car: VehicleParameters) -> tuple[float, float]:
    """Return (throttle, brake), 0 to 1 each, for what the tyres are to give."""
    if tyre_mps2 <= 0.0:
        return 0.0, min(1.0, -tyre_mps2 / car.max_brake_decel_mps2)
    full_mps2 = min(car.max_drive_force_n, car.max_drive_power_w / max(0.1, speed_mps)) / car.mass_kg
    share = car.throttle_dead_band + (1.0 - car.throttle_dead_band) * tyre_mps2 / full_mps2
    return min(1.0, share), 0.0


class ReferenceWrenchStack:
    """Drives one vehicle along its route with throttle, brake and steering efforts.

    Args:
        address: The JAUS address under which it speaks, to know whether it has control.
        car: What it knows of its car.
        settings: What it wants of the road.
    """

    def __init__(
        self,
        address: JausAddress,
        car: VehicleParameters,
        settings: ReferenceStackSettings | None = None,
    ) -> None:
        self._address = address
        self._car = car
        self._settings = settings or ReferenceStackSettings()
        self._driving = RouteDriving(self._settings)
        self._wanted_mps = 0.0
        self._integral_m = 0.0
        self._before_s: float | None = None

    def act(self, observation: Observation) -> list[StackMessage]:
        """Return the messages of one cycle: session first, then the efforts."""
        wish = self._driving.wish(observation)
        messages = open_loop_session(
            observation,
            self._address,
            self._settings.authority,
            takes_over=self._driving.may_take_over(observation, wish),
        )
        messages.append(self._effort(observation, wish))
        return messages

    def _effort(self, seen: Observation, wish: Wish) -> WrenchEffort:
        elapsed_s = 0.0 if self._before_s is None else seen.time_s - self._before_s
        self._before_s = seen.time_s
        steering = steering_share(wish.curvature_per_m, seen.speed_mps, self._car)
        stands = seen.speed_mps < STANDS_MPS and wish.accel_mps2 <= 0.0
        if stands or seen.safety_mode != DRIVES:
            self._wanted_mps, self._integral_m = seen.speed_mps, 0.0
            return WrenchEffort(0.0, HOLDING_BRAKE if stands else 0.0, steering)
        wanted_mps = self._wanted_mps + wish.accel_mps2 * elapsed_s
        lowest, highest = seen.speed_mps - MOST_ERROR_MPS, seen.speed_mps + MOST_ERROR_MPS
        self._wanted_mps = max(0.0, min(highest, max(lowest, wanted_mps)))
        error_mps = self._wanted_mps - seen.speed_mps
        self._integral_m = min(
            MOST_INTEGRAL_M, max(-MOST_INTEGRAL_M, self._integral_m + error_mps * elapsed_s)
        )
        demand = wish.accel_mps2 + GAIN_PER_S * error_mps + INTEGRAL_GAIN_PER_S2 * self._integral_m
        throttle, brake = pedal_shares(
            demand + self._road_load_mps2(seen.speed_mps), seen.speed_mps, self._car
        )
        return WrenchEffort(throttle, brake, steering)

    def _road_load_mps2(self, speed_mps: float) -> float:
        car = self._car
        drag = 0.5 * car.air_density_kg_per_m3 * car.drag_area_m2 * speed_mps * speed_mps / car.mass_kg
        return car.rolling_resistance * GRAVITY_MPS2 + drag
