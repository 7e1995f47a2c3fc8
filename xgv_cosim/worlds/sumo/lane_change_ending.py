"""Has SUMO end the lane change of a driver from whom the computer takes the wheel.

No command ends it (measured: neither ``moveTo`` nor ``moveToXY``, no mode, route or type), and SUMO crashes
if the vehicle is placed in the other lane meanwhile: in the middle it changes to the lane beside, which is
then one too far. But who may move sideways fast enough ends it within one step. That SUMO has the vehicle at
the centre of the new lane then does not matter: ``moveToXY`` comes after that in the same step (measured).
SUMO's own heading of the vehicle follows slowly; see ``placing`` for when it may be mirrored again.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from xgv_cosim.worlds.sumo.engine import errors_of

if TYPE_CHECKING:
    from xgv_cosim.worlds.sumo.engine import Engine

_AT_ONCE_MPS = 1e4
"""Sideways over any lane within any step."""
_BOUND_AT_REST = "laneChangeModel.lcMaxSpeedLatStanding"
"""What SUMO adds to the forward speed for the lane-change model's own bound of the sideways speed."""

_NOT_KNOWN = "does not support laneChangeModel parameter"
"""In SUMO's message where the vehicle's lane-change model has no such bound."""


class _Own(NamedTuple):
    """What a vehicle had before; nothing of it matters to SUMO but during lane changes."""

    vehicle_id: str
    type_id: str
    sideways_mps: float
    bound_at_rest: str | None
    """None: its lane-change model knows none."""


@dataclass(slots=True)
class LaneChangeEnding:
    """Quickens lane changes for one step."""

    engine: Engine
    _quick: list[_Own] = field(default_factory=list)

    def quicken(self, vehicle_id: str) -> None:
        """Have a lane change end in the coming step, for a vehicle that is placed freely in it."""
        vehicle = self.engine.vehicle
        bound = self._bound_at_rest(vehicle_id)
        own = _Own(vehicle_id, vehicle.getTypeID(vehicle_id), vehicle.getMaxSpeedLat(vehicle_id), bound)
        self._quick.append(own)
        vehicle.setMaxSpeedLat(vehicle_id, _AT_ONCE_MPS)
        if bound is not None:
            vehicle.setParameter(vehicle_id, _BOUND_AT_REST, str(_AT_ONCE_MPS))

    def _bound_at_rest(self, vehicle_id: str) -> str | None:
        try:
            bound: str = self.engine.vehicle.getParameter(vehicle_id, _BOUND_AT_REST)
        except errors_of(self.engine) as error:
            if _NOT_KNOWN not in str(error):
                raise
            return None
        return bound

    def settle(self) -> None:
        """Take it back after the step, from whom SUMO still has."""
        if not self._quick:
            return
        vehicle = self.engine.vehicle
        present = {*vehicle.getIDList(), *vehicle.getTeleportingIDList()}
        for vehicle_id, type_id, sideways_mps, bound in self._quick:
            if vehicle_id not in present:
                continue
            if vehicle.getTypeID(vehicle_id) == type_id:  # the vehicle's very own before us
                vehicle.setMaxSpeedLat(vehicle_id, sideways_mps)
            else:
                vehicle.setType(vehicle_id, type_id)
            if bound is not None:
                vehicle.setParameter(vehicle_id, _BOUND_AT_REST, bound)
        self._quick.clear()
