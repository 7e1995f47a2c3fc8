"""The bound vehicles of a SUMO world: which coupling writes each of them, in each step."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.actuation import CouplingKind
from xgv_cosim.errors import WorldError
from xgv_cosim.worlds.sumo.arrivals import ArrivalPositions
from xgv_cosim.worlds.sumo.automatic import TOLERANCE_M, TOLERANCE_RAD, Choice, is_exact
from xgv_cosim.worlds.sumo.couplings import (
    NO_SPEED_CHECKS,
    CarFollowing,
    Coupling,
    FreeCoupling,
    LaneChangeEnding,
    LaneCoupling,
    LaneKeeping,
    LateralEasing,
    MirrorCoupling,
    Target,
    WorldDriver,
    enter,
    let_drive,
)
from xgv_cosim.worlds.sumo.ghosts import Ghosts
from xgv_cosim.worlds.sumo.handover import HeadingEasing, SpeedEasing
from xgv_cosim.worlds.sumo.lane_frame import InLane, LaneFrames
from xgv_cosim.worlds.sumo.standstill import Standstill
from xgv_cosim.worlds.sumo.straddling import Owners, Straddling

if TYPE_CHECKING:
    from xgv_cosim.columns import BoolColumn, IntColumn
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.base import Placement
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.road import SumoRoad

_ROUTE_END_MARGIN_M = 0.1
"""So close to its end a route counts as driven: SUMO pins a placed vehicle to the last centimetres."""


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


class Bindings:
    """Writes every bound vehicle with the coupling that its ownership asks for."""

    def __init__(self, engine: Engine, road: SumoRoad, step_s: float, *, with_ghosts: bool = True) -> None:
        self.bound: dict[str, Binding] = {}
        self._held: dict[str, Target] = {}
        self._engine = engine
        self._road = road
        self._step_s = step_s
        self._notes: list[tuple[str, str]] = []
        self._free = FreeCoupling(engine, step_s)
        self._lane = LaneCoupling(engine, step_s)
        self._mirror = MirrorCoupling(engine, step_s)
        self._by_kind: dict[CouplingKind, Coupling] = {
            CouplingKind.FREE: self._free,
            CouplingKind.LANE: self._lane,
            CouplingKind.AUTO: self._mirror,  # as long as it is exact, see ``write``
        }
        self._change_ending = LaneChangeEnding(engine, step_s)
        self._lane_keeping = LaneKeeping(engine, step_s)
        self._car_following = CarFollowing(engine)
        self._world_driver = WorldDriver()
        self._easing = LateralEasing(engine, step_s)
        self._speed_easing = SpeedEasing(engine, road, step_s)
        self.headings = HeadingEasing(step_s)
        self._arrivals = ArrivalPositions(engine)
        self._frames = LaneFrames(road)
        self._straddling = Straddling(road) if with_ghosts else None
        self._standstill = Standstill(engine, step_s)
        self.ghosts = Ghosts(engine, road, self._standstill)

    def add(self, vehicle_id: str, kind: CouplingKind) -> None:
        """Take a vehicle in; SUMO drives it until the next step."""
        self._held.pop(vehicle_id, None)
        self.bound[vehicle_id] = Binding(kind)

    def hold(self, vehicle_id: str, now: Snapshot, row: int) -> None:
        """Keep a vehicle that is not bound where it is."""
        if vehicle_id in self._held:
            return
        self._engine.vehicle.setSpeedMode(vehicle_id, self._free.speed_mode)
        self._engine.vehicle.setLaneChangeMode(vehicle_id, self._free.lane_change_mode)
        self._held[vehicle_id] = Target(
            vehicle_id,
            float(now.front_x_m[row]),
            float(now.front_y_m[row]),
            float(now.heading_rad[row]),
            speed_mps=0.0,
            travelled_m=0.0,
            along_m=0.0,
            lateral_m=0.0,
            ends_route=False,
        )

    def give_back(self, vehicle_id: str, now: Snapshot) -> None:
        """Leave a vehicle to SUMO's driver for good.

        Off the road SUMO drives nobody: it would keep the vehicle on its list of teleports and never bring
        it back (measured). There the vehicle is held where it is until it is bound again. Who is parked is
        on no lane either, but SUMO's driver knows his way back.
        """
        row = now.index_of.get(vehicle_id)
        off_road = row is not None and now.lane[row] < 0
        off_road = off_road and not self._engine.vehicle.isStoppedParking(vehicle_id)
        self._switch(vehicle_id, self.bound[vehicle_id], self._free if off_road else self._world_driver, now)
        del self.bound[vehicle_id]
        self._forget_lanes(vehicle_id)
        if row is not None and off_road:
            self._notes.append((vehicle_id, "released off the road, where SUMO drives nobody: stands there"))
            self.hold(vehicle_id, now, row)

    def _forget_lanes(self, vehicle_id: str) -> None:
        self._frames.forget(vehicle_id)
        if self._straddling is not None:
            self._straddling.forget(vehicle_id)

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle that SUMO has no longer."""
        self.bound.pop(vehicle_id, None)
        self._held.pop(vehicle_id, None)
        self._standstill.forget(vehicle_id)
        self._forget_lanes(vehicle_id)
        self._easing.end(vehicle_id)
        self._speed_easing.forget(vehicle_id)
        self.headings.end(vehicle_id)

    def settle(self) -> None:
        """Leave nothing of ours behind: SUMO goes on without us.

        What eases hand-overs is taken back, so cars beside their lane's centre are on it at once; ghosts go;
        who is held (a wreck, a car off the road) is SUMO's driver's again.
        """
        self._speed_easing.settle()
        self.ghosts.drop_lost()
        self.ghosts.show(())
        present = set(self._engine.vehicle.getIDList())
        self._easing.settle(present)
        for target in self._held.values():
            if target.vehicle_id in present:
                let_drive(self._engine, target)
        self._held.clear()

    def after_step(self) -> None:
        """Set right what SUMO's step has left, before anybody reads it."""
        self._standstill.settle()
        self.ghosts.drop_lost()

    def take_notes(self) -> tuple[tuple[str, str], ...]:
        """Return what happened since the last call."""
        notes = tuple(self._notes)
        self._notes.clear()
        return notes

    def write(self, placement: Placement, before: Snapshot) -> None:
        """Write all vehicles of the placement, seen from the state before the step.

        Raises:
            WorldError: One of them is not bound; none has been written then.
        """
        for vehicle_id in placement.ids:
            if vehicle_id not in self.bound:
                raise WorldError(f"vehicle {vehicle_id!r} is placed but not bound; bind it first")
        if not before.ids:
            return
        self._write_held(before)
        rows = np.array([before.index_of.get(vehicle_id, -1) for vehicle_id in placement.ids], np.int64)
        ends_route = self._ends_route(placement, before, rows)
        in_lane = self._in_lane(placement, before, rows)
        leads_on = self._leads_on(placement, before, rows) | ends_route
        along_m = in_lane.position_m - before.lane_position_m[rows]
        exact = is_exact(in_lane, along_m, at_rest=placement.speed_mps == 0.0) & leads_on
        inside = ~(np.abs(in_lane.body_lateral_m) > 0.5 * in_lane.width_m)
        freely = np.zeros(len(rows), np.bool_)
        for number, vehicle_id in enumerate(placement.ids):
            binding = self.bound[vehicle_id]
            if rows[number] < 0:
                continue  # SUMO holds it outside the net for the moment
            coupling = self._asked_for(
                binding, bool(placement.computer_speed[number]), bool(placement.computer_steering[number])
            )
            if coupling is self._mirror:
                coupling = self._mirror if binding.choice.mirrors(bool(exact[number])) else self._free
                binding.gives_way = ""
            elif coupling is self._free:
                binding.gives_way = ""
            else:
                coupling = self._possible(
                    vehicle_id,
                    binding,
                    coupling,
                    off_road=before.lane[rows[number]] < 0,
                    outside=not inside[number] and not ends_route[number],
                    reverses=placement.travelled_m[number] < 0.0,
                    leads_on=bool(leads_on[number]),
                )
            on_road = before.lane[rows[number]] >= 0
            if self._is_changing_lanes(vehicle_id, binding, coupling) and on_road:
                coupling = self._change_ending if coupling is not self._car_following else coupling
            self._switch(vehicle_id, binding, coupling, before)
            freely[number] = coupling is self._free
            row = rows[number]
            ours = coupling.speed_mode == NO_SPEED_CHECKS
            at_rest = ours and placement.speed_mps[number] == 0.0 == before.speed_mps[row]
            if self._standstill.is_due(vehicle_id, at_rest=bool(at_rest)):
                self._standstill.stir(
                    vehicle_id,
                    float(before.front_x_m[row]),
                    float(before.front_y_m[row]),
                    float(before.heading_rad[row]),
                )
                continue
            coupling.write(
                Target(
                    vehicle_id,
                    float(placement.front_x_m[number]),
                    float(placement.front_y_m[number]),
                    float(placement.heading_rad[number]),
                    float(placement.speed_mps[number]),
                    float(placement.travelled_m[number]),
                    float(along_m[number]),
                    float(in_lane.lateral_m[number]),
                    bool(ends_route[number]),
                )
            )
        self._show_ghosts(placement, before, rows, in_lane, freely)
        self._easing.advance()
        self._speed_easing.advance(before)

    def _write_held(self, before: Snapshot) -> None:
        for target in self._held.values():
            if target.vehicle_id not in before.index_of:
                continue
            if self._standstill.is_due(target.vehicle_id, at_rest=True):
                self._standstill.stir(
                    target.vehicle_id, target.front_x_m, target.front_y_m, target.heading_rad
                )
            else:
                self._free.write(target)

    def _show_ghosts(
        self,
        placement: Placement,
        before: Snapshot,
        rows: IntColumn,
        in_lane: InLane,
        freely: BoolColumn,
    ) -> None:
        """Have ghosts where bodies reach into further lanes; SUMO's own driver sees to his lane changes."""
        if self._straddling is None:
            return
        by_plant = placement.computer_steering.copy()
        poses = [placement.front_x_m.copy(), placement.front_y_m.copy(), placement.heading_rad.copy()]
        for number, name in enumerate(placement.ids):
            if rows[number] >= 0 and self._easing.is_under_way(name):
                by_plant[number] = True  # the driver's, but SUMO does not know of this way across the line
                row, way_m = rows[number], before.speed_mps[rows[number]] * self._step_s
                poses[0][number] = before.front_x_m[row] + way_m * np.cos(before.heading_rad[row])
                poses[1][number] = before.front_y_m[row] + way_m * np.sin(before.heading_rad[row])
                poses[2][number] = before.heading_rad[row]
        shown = placement._replace(front_x_m=poses[0], front_y_m=poses[1], heading_rad=poses[2])
        owners = Owners(by_plant, freely)
        self.ghosts.show(self._straddling.reaches(shown, before, rows, in_lane, owners, self.ghosts.standing))

    @property
    def in_lane_frame(self) -> frozenset[str]:
        """Return who was written as speed and lateral position in its lane in the last step."""
        own = {self._lane, self._mirror}
        return frozenset(name for name, binding in self.bound.items() if binding.coupling in own)

    def learn(self, after: Snapshot) -> None:
        """Place those freely for a while whom SUMO has further from the plant's pose than was foreseen."""
        wrong = (after.placement_error_m > TOLERANCE_M) | (after.placement_error_rad > TOLERANCE_RAD)
        for row in np.flatnonzero(wrong & after.in_lane_frame).tolist():
            binding = self.bound.get(after.ids[row])
            if binding is not None:
                binding.choice.refuse()

    def _is_changing_lanes(self, vehicle_id: str, binding: Binding, coupling: Coupling) -> bool:
        """Return whether SUMO has still to end a lane change of its driver; the computer has the wheel."""
        by_driver = {None, self._lane_keeping, self._world_driver}
        if coupling in by_driver or not (binding.coupling in by_driver or binding.changes_lane):
            binding.changes_lane = False
        else:
            binding.changes_lane = self._engine.vehicle.getLateralSpeed(vehicle_id) != 0.0
        return binding.changes_lane

    def _asked_for(self, binding: Binding, computer_speed: bool, computer_steering: bool) -> Coupling:
        """Return the coupling that ownership asks for, see ``couplings``."""
        if computer_speed and computer_steering:
            return self._by_kind[binding.kind]
        if computer_speed:
            return self._lane_keeping
        if computer_steering:
            return self._car_following
        return self._world_driver

    def _possible(
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
        elif outside and asked in {self._lane, self._car_following}:
            reason = "body centre outside the lane"
        elif reverses and asked in {self._lane, self._lane_keeping}:
            reason = "reversing, which SUMO's lanes do not know"
        elif not leads_on and asked is self._lane:
            reason = "at the end of a lane that does not lead on along its route"
        if reason != binding.gives_way:
            self._notes.append((vehicle_id, f"placed freely: {reason}" if reason else "back in its lane"))
            binding.gives_way = reason
        return self._free if reason else asked

    def _switch(self, vehicle_id: str, binding: Binding, coupling: Coupling, now: Snapshot) -> None:
        """Make ``coupling`` the one that writes the vehicle; calls SUMO only on a change."""
        if binding.coupling is coupling:
            return
        enter(self._engine, vehicle_id, coupling, binding.coupling)
        row = now.index_of.get(vehicle_id)
        if coupling.speed_mode == NO_SPEED_CHECKS:
            self._speed_easing.end(vehicle_id)
        elif (
            binding.coupling is not None
            and binding.coupling.speed_mode == NO_SPEED_CHECKS
            and row is not None
        ):
            self._speed_easing.begin(vehicle_id, float(now.speed_mps[row]), float(now.accel_mps2[row]))
        driver_steered = binding.coupling in {self._lane_keeping, self._world_driver}
        if coupling not in {self._lane_keeping, self._world_driver}:
            self._easing.end(vehicle_id)
            self.headings.end(vehicle_id)
        elif binding.coupling is not None and not driver_steered:
            self._easing.begin(vehicle_id)
            self.headings.begin(vehicle_id)
        binding.coupling = coupling

    def _in_lane(self, placement: Placement, before: Snapshot, rows: IntColumn) -> InLane:
        """Return where the placed vehicles lie in their lanes; 0 for whom SUMO has nowhere."""
        here = rows >= 0
        self._frames.follow(
            placement.ids, np.where(here, before.lane[rows], -1), np.where(here, before.next_lane[rows], -1)
        )
        columns = InLane(*(np.zeros(len(rows)) for _ in InLane._fields))
        asked = np.flatnonzero(here)
        found = self._frames.project(placement, before, rows[asked], asked)
        for column, values in zip(columns, found, strict=True):
            column[asked] = values
        return columns

    def _leads_on(self, placement: Placement, before: Snapshot, rows: IntColumn) -> BoolColumn:
        """Return whose lane goes on along the route, or does not end within this step."""
        lane = np.where(rows >= 0, before.lane[rows], -1)
        left_m = self._road.lane_length_m(lane) - before.lane_position_m[rows]
        reach_m = np.maximum(placement.travelled_m, placement.speed_mps * self._step_s)
        leads_on: BoolColumn = (before.next_lane[rows] >= 0) | (left_m > reach_m)
        return leads_on

    def _ends_route(self, placement: Placement, before: Snapshot, rows: IntColumn) -> BoolColumn:
        """Return whose route ends within this step, at the arrival position if the demand names one."""
        lane = np.where(rows >= 0, before.lane[rows], -1)
        reach_m = np.maximum(placement.travelled_m, placement.speed_mps * self._step_s)
        arrival_m = self._road.lane_length_m(lane)
        for number in np.flatnonzero((lane >= 0) & (before.next_lane[rows] < 0)):
            edge_id = self._road.edge_ids[lane[number]]
            length_m = float(arrival_m[number])
            arrival_m[number] = self._arrivals.position_m(placement.ids[number], edge_id, length_m)
        left_m = arrival_m - before.lane_position_m[rows] - _ROUTE_END_MARGIN_M
        ends = (lane >= 0) & (reach_m > 0.0) & (left_m <= reach_m)
        for number in np.flatnonzero(ends):
            edge_id = self._road.edge_ids[lane[number]]
            ends[number] = self._arrivals.is_on_last_edge(placement.ids[number], edge_id)
        return ends
