"""The couplings of an open simulation, and what is told of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from xgv_cosim.worlds.sumo.couplings import (
    CarFollowing,
    Coupling,
    FreeCoupling,
    LaneCoupling,
    LaneKeeping,
    MirrorCoupling,
    WorldDriver,
)
from xgv_cosim.worlds.sumo.placing_tables import Way, Yields

if TYPE_CHECKING:
    from xgv_cosim.worlds.sumo.lane_frame import LaneFrame

WHY_FREE = {
    Yields.OFF_ROAD: "off the road, where SUMO drives nobody",
    Yields.OUTSIDE: "body centre outside the lane",
    Yields.REVERSES: "reversing, which SUMO's lanes do not know",
    Yields.DEAD_END: "at the end of a lane that does not lead on along its route",
}


class Couplings:
    """One of each kind."""

    def __init__(self, frame: LaneFrame) -> None:
        self.frame = frame
        self.free = FreeCoupling(frame)
        self.by_way: dict[Way, Coupling] = {
            Way.FREE: self.free,
            Way.LANE: LaneCoupling(frame),
            Way.MIRROR: MirrorCoupling(frame),
            Way.LANE_KEEPING: LaneKeeping(frame),
            Way.CAR_FOLLOWING: CarFollowing(frame),
            Way.WORLD_DRIVER: WorldDriver(),
        }


def told(yields: Yields) -> str:
    """Return what is told when the free coupling begins or ends to stand in for another."""
    return f"placed freely: {WHY_FREE[yields]}" if yields else "back in its lane"
