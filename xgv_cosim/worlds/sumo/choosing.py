"""Which coupling writes a bound vehicle: what ownership asks for, as far as SUMO can do it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo.automatic import Choice
from xgv_cosim.worlds.sumo.couplings import (
    CarFollowing,
    Coupling,
    FreeCoupling,
    LaneChangeEnding,
    LaneCoupling,
    LaneKeeping,
    MirrorCoupling,
    WorldDriver,
)

if TYPE_CHECKING:
    from xgv_cosim.worlds.sumo.engine import Engine


@dataclass(slots=True)
class Binding:
    """One bound vehicle."""

    kind: CouplingKind
    coupling: Coupling | None = None
    """What wrote it last, None before the first step."""
    gives_way: str = ""
    """Why the free coupling stands in for the one that ownership asks for, empty while it does not."""
    changes_lane: bool = False
    """SUMO has not yet ended a lane change of its driver, from whom the computer has taken the wheel."""
    choice: Choice = field(default_factory=Choice)
    """Between the two that ``CouplingKind.AUTO`` has."""


class Choosing:
    """The couplings of an open simulation, and who gets which."""

    def __init__(self, engine: Engine, step_s: float) -> None:
        self._engine = engine
        self.notes: list[tuple[str, str]] = []
        """(vehicle, what happened), until somebody takes them."""
        self.free = FreeCoupling(engine, step_s)
        self.lane = LaneCoupling(engine, step_s)
        self.mirror = MirrorCoupling(engine, step_s)
        self._by_kind: dict[CouplingKind, Coupling] = {
            CouplingKind.FREE: self.free,
            CouplingKind.LANE: self.lane,
            CouplingKind.AUTO: self.mirror,  # as long as it is exact, see ``Bindings.write``
        }
        self.change_ending = LaneChangeEnding(engine, step_s)
        self.lane_keeping = LaneKeeping(engine, step_s)
        self.car_following = CarFollowing(engine)
        self.world_driver = WorldDriver()

    def is_changing_lanes(self, vehicle_id: str, binding: Binding, coupling: Coupling) -> bool:
        """Return whether SUMO has still to end a lane change of its driver; the computer has the wheel."""
        by_driver = {None, self.lane_keeping, self.world_driver}
        if coupling in by_driver or not (binding.coupling in by_driver or binding.changes_lane):
            binding.changes_lane = False
        else:
            binding.changes_lane = self._engine.vehicle.getLateralSpeed(vehicle_id) != 0.0
        return binding.changes_lane

    def asked_for(self, binding: Binding, computer_speed: bool, computer_steering: bool) -> Coupling:
        """Return the coupling that ownership asks for, see ``couplings``."""
        if computer_speed and computer_steering:
            return self._by_kind[binding.kind]
        if computer_speed:
            return self.lane_keeping
        if computer_steering:
            return self.car_following
        return self.world_driver

    def possible(
        self,
        vehicle_id: str,
        binding: Binding,
        asked: Coupling,
        *,
        off_road: bool,
        outside: bool,
        reverses: bool,
        leads_on: bool,
    ) -> Coupling:
        """Return ``asked``, or the free coupling where SUMO cannot do that; a note says when and why."""
        reason = ""
        if off_road:
            reason = "off the road, where SUMO drives nobody"
        elif outside and asked in {self.lane, self.car_following}:
            reason = "body centre outside the lane"
        elif reverses and asked in {self.lane, self.lane_keeping}:
            reason = "reversing, which SUMO's lanes do not know"
        elif not leads_on and asked is self.lane:
            reason = "at the end of a lane that does not lead on along its route"
        if reason != binding.gives_way:
            self.notes.append((vehicle_id, f"placed freely: {reason}" if reason else "back in its lane"))
            binding.gives_way = reason
        return self.free if reason else asked
