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
    from xgv_cosim.columns import FloatMatrix
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
def vehicle_of(table: FloatMatrix, slot: int) -> VehicleParameters:
    """Return the parameters of a slot, see ``parameters.ParameterTable``.

    To the compiler it is a tuple of numbers named like the columns, because it knows no dataclass; to
    a reader and to mypy it is a ``VehicleParameters``. A test holds both lists of names together.
    """
    row = table[slot]
    return ParameterColumns(  # type: ignore[return-value]
        row[0],
        row[1],
        row[2],
        row[3],
        row[4],
        row[5],
        row[6],
        row[7],
        row[8],
        row[9],
        row[10],
        row[11],
        row[12],
        row[13],
        row[14],
        row[15],
        row[16],
        row[17],
        row[18],
        row[19],
        row[20],
        row[21],
        row[22],
        row[23],
        row[24],
        row[25],
        row[26],
        row[27],
        row[28],
        row[29],
        row[30],
        row[31],
        row[32],
        row[33],
        row[34],
        row[35],
        row[36],
        row[37],
        row[38],
        row[39],
        row[40],
        row[41],
        row[42],
        row[43],
        row[44],
        row[45],
        row[46],
        row[47],
        row[48],
        row[49],
    )
