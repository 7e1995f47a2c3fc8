"""One slot's parameters as scalars, and what follows from them for all ticks of a step.

Inside the compiled loop only scalars are passed on: handing whole columns from function to function
would count references to each of them, which costs a hundred times what the loop does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from xgv_cosim.jit import inlinable
from xgv_cosim.parameters import ParameterColumns
from xgv_cosim.plant.actuators import lag_share
from xgv_cosim.plant.longitudinal import normal_mps2, parking_brake_mps2, slope_mps2

if TYPE_CHECKING:
    from xgv_cosim.kernel.orders import Orders
    from xgv_cosim.parameters import VehicleParameters


class Lags(NamedTuple):
    """Shares of first-order lags in one tick, and by how much a pedal's command leads over its lag."""

    throttle: float
    brake: float
    steer: float
    throttle_lead: float
    brake_lead: float


@inlinable
def lags_of(vehicle: VehicleParameters, dt: float) -> Lags:
    """Return the lags of a vehicle for ticks of ``dt``; a lead of 1 leaves the actuator its own lag."""
    throttle, brake = lag_share(vehicle.throttle_lag_s, dt), lag_share(vehicle.brake_lag_s, dt)
    response = lag_share(vehicle.speed_response_s, dt)
    steer = lag_share(vehicle.steer_lag_s, dt)
    return Lags(throttle, brake, steer, max(1.0, response / throttle), max(1.0, response / brake))


class Road(NamedTuple):
    """What the road does to a car, as accelerations; the same at any speed."""

    slope_mps2: float
    """Backwards along the car's heading: positive uphill."""
    grip_mps2: float
    rolling_mps2: float
    parking_brake_mps2: float
    """Against motion, within the grip: 0 while the parking brake is released."""


@inlinable
def road_of(vehicle: VehicleParameters, orders: Orders) -> Road:
    """Return the road under a vehicle; a parking brake that is set holds it at once (XGV-60)."""
    normal = normal_mps2(vehicle.grade)
    grip = vehicle.friction * normal
    return Road(
        slope_mps2(vehicle.grade),
        grip,
        vehicle.rolling_resistance * normal,
        parking_brake_mps2(orders.has_parking_brake, vehicle.parking_brake_decel_mps2, grip),
    )


@inlinable
def vehicle_of(columns: ParameterColumns, slot: int) -> VehicleParameters:
    """Return the parameters of a slot.

    To the compiler it is a tuple of numbers named like the columns, because it knows no dataclass; to
    a reader and to mypy it is a ``VehicleParameters``. A test holds both lists of names together.
    """
    return ParameterColumns(  # type: ignore[return-value]
        columns.wheelbase_m[slot],
        columns.front_overhang_m[slot],
        columns.front_track_m[slot],
        columns.rear_track_m[slot],
        columns.mass_kg[slot],
        columns.max_curvature_per_m[slot],
        columns.max_curvature_rate_per_m_s[slot],
        columns.max_curvature_jerk_per_m_s2[slot],
        columns.max_accel_mps2[slot],
        columns.max_decel_mps2[slot],
        columns.max_jerk_mps3[slot],
        columns.throttle_dead_band[slot],
        columns.throttle_lag_s[slot],
        columns.max_drive_force_n[slot],
        columns.max_drive_power_w[slot],
        columns.creep_accel_mps2[slot],
        columns.creep_speed_mps[slot],
        columns.low_engine_braking_mps2[slot],
        columns.low_speed_cap_mps[slot],
        columns.shift_speed_mps[slot],
        columns.shift_brake[slot],
        columns.shift_standstill_s[slot],
        columns.shift_delay_s[slot],
        columns.brake_lag_s[slot],
        columns.max_brake_decel_mps2[slot],
        columns.unassisted_brake_share[slot],
        columns.parking_brake_decel_mps2[slot],
        columns.friction[slot],
        columns.min_lateral_grip[slot],
        columns.rolling_resistance[slot],
        columns.drag_area_m2[slot],
        columns.air_density_kg_per_m3[slot],
        columns.grade[slot],
        columns.max_steer_rad[slot],
        columns.max_steer_rate_rad_s[slot],
        columns.steer_lag_s[slot],
        columns.understeer_rad_s2_per_m[slot],
        columns.yaw_lag_s2_per_m[slot],
        columns.released_steering_self_aligns[slot],
        columns.self_align_distance_m[slot],
        columns.speed_gain_per_s[slot],
        columns.speed_integral_gain_per_s2[slot],
        columns.speed_response_s[slot],
        columns.pedal_band_mps2[slot],
        columns.standstill_brake[slot],
        columns.steer_backlash_rad[slot],
        columns.speed_quantum_mps[slot],
        columns.speed_noise_mps[slot],
        columns.command_latency_s[slot],
        columns.command_jitter_s[slot],
    )
