"""Standing vehicles that SUMO must not beam away.

SUMO takes a vehicle off the road that has waited for ``--time-to-teleport`` (300 s unless told), a placed one
too, and a type may ask for it with ``timeToTeleport`` whatever the option says. What counts is the time
since it was last faster than 0.1 m/s. So a vehicle that we hold at rest is given 0.11 m/s for one step now
and then, while its pose is set to where it stands, and 0 again at once after that step: nobody ever sees it
move. How often, follows from SUMO's options; what a type asks for cannot be read from SUMO.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from xgv_cosim.worlds.sumo.couplings import KEEP_ROUTE_AND_POSE, MATCH_THRESHOLD_M
from xgv_cosim.worlds.sumo.frames import angle_to_sumo
from xgv_cosim.worlds.sumo.times import seconds_of

if TYPE_CHECKING:
    from xgv_cosim.worlds.sumo.engine import Engine

_LONGEST_PERIOD_S = 10.0
"""So often at least a standing vehicle is kept from waiting: a type may have a time of its own."""
_SHARE = 0.5
"""It is kept from it after this share of the shortest time to teleport: it may have crept before it stood."""
_TIMES = ("time-to-teleport", "time-to-teleport.highways")
"""Options that SUMO heeds above 0."""
_TIMES_FROM_ZERO = ("time-to-teleport.disconnected", "time-to-teleport.bidi")
"""Options that SUMO heeds from 0 on."""
_NOT_WAITING_MPS = 0.11


def period_s(engine: Engine) -> float:
    """Return how often a standing vehicle is to be kept from waiting, as the open simulation was started."""
    option = engine.simulation.getOption
    times_s = [seconds_of(option(name)) for name in _TIMES]
    times_s = [time_s for time_s in times_s if time_s > 0.0]
    from_zero_s = [seconds_of(option(name)) for name in _TIMES_FROM_ZERO]
    times_s += [time_s for time_s in from_zero_s if time_s >= 0.0]
    return min([_LONGEST_PERIOD_S, *(_SHARE * time_s for time_s in times_s)])


@dataclass(slots=True)
class Standstill:
    """Counts how long vehicles are held at rest, and keeps SUMO's count low."""

    engine: Engine
    step_s: float
    period_s: float
    _steps: dict[str, int] = field(default_factory=dict)
    _stirred: list[str] = field(default_factory=list)

    def is_due(self, vehicle_id: str, *, at_rest: bool) -> bool:
        """Return whether a vehicle that we hold is to be stirred in the coming step; call once a step."""
        if not at_rest:
            self._steps.pop(vehicle_id, None)
            return False
        steps = self._steps.get(vehicle_id, 0) + 1
        due = steps * self.step_s >= self.period_s
        self._steps[vehicle_id] = 0 if due else steps
        return due

    def stir(self, vehicle_id: str, front_x_m: float, front_y_m: float, heading_rad: float) -> None:
        """Have a vehicle not wait in the coming step, and stand where it is after it."""
        self._stirred.append(vehicle_id)
        self.engine.vehicle.setSpeed(vehicle_id, _NOT_WAITING_MPS)
        self.engine.vehicle.moveToXY(
            vehicle_id,
            "",
            -1,
            front_x_m,
            front_y_m,
            angle_to_sumo(heading_rad),
            KEEP_ROUTE_AND_POSE,
            MATCH_THRESHOLD_M,
        )

    def settle(self) -> None:
        """Take the speed back after the step."""
        if not self._stirred:
            return
        present = set(self.engine.vehicle.getIDList())
        for vehicle_id in self._stirred:
            if vehicle_id in present:
                self.engine.vehicle.setPreviousSpeed(vehicle_id, 0.0)
        self._stirred.clear()

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle."""
        self._steps.pop(vehicle_id, None)
