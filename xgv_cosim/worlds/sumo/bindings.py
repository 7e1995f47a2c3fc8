"""The bound vehicles of a SUMO world: which coupling writes each of them, in each step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.errors import WorldError
from xgv_cosim.worlds.sumo.automatic import TOLERANCE_M, TOLERANCE_RAD, is_exact
from xgv_cosim.worlds.sumo.choosing import Binding, Choosing
from xgv_cosim.worlds.sumo.couplings import NO_SPEED_CHECKS, Target
from xgv_cosim.worlds.sumo.ghosts import Ghosts
from xgv_cosim.worlds.sumo.held import Held
from xgv_cosim.worlds.sumo.lane_frame import InLane, LaneFrames
from xgv_cosim.worlds.sumo.route_ends import RouteEnds
from xgv_cosim.worlds.sumo.standstill import Standstill
from xgv_cosim.worlds.sumo.straddling import Owners, Straddling
from xgv_cosim.worlds.sumo.switching import Switching

if TYPE_CHECKING:
    from xgv_cosim.actuation import CouplingKind
    from xgv_cosim.columns import BoolColumn, IntColumn
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.base import Placement
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.handover import HeadingEasing
    from xgv_cosim.worlds.sumo.road import SumoRoad


class Bindings:
    """Writes every bound vehicle with the coupling that its ownership asks for."""

    def __init__(self, engine: Engine, road: SumoRoad, step_s: float, *, with_ghosts: bool = True) -> None:
        self.bound: dict[str, Binding] = {}
        self._engine = engine
        self._step_s = step_s
        self._choosing = Choosing(engine, step_s)
        self._switching = Switching(engine, road, step_s, self._choosing)
        self._ends = RouteEnds(engine, road, step_s)
        self._frames = LaneFrames(road)
        self._straddling = Straddling(road) if with_ghosts else None
        self._standstill = Standstill(engine, step_s)
        self._held = Held(engine, self._choosing.free, self._standstill)
        self.ghosts = Ghosts(engine, road, self._standstill)

    @property
    def headings(self) -> HeadingEasing:
        """Return what turns cars whose wheel the world's driver has taken to their lanes by and by."""
        return self._switching.headings

    def hold(self, vehicle_id: str, now: Snapshot, row: int) -> None:
        """Keep a vehicle that is not bound where it is."""
        self._held.hold(vehicle_id, now, row)

    def add(self, vehicle_id: str, kind: CouplingKind) -> None:
        """Take a vehicle in; SUMO drives it until the next step."""
        self._held.forget(vehicle_id)
        self.bound[vehicle_id] = Binding(kind)

    def give_back(self, vehicle_id: str, now: Snapshot) -> None:
        """Leave a vehicle to SUMO's driver for good.

        Off the road SUMO drives nobody: it would keep the vehicle on its list of teleports and never bring
        it back (measured). There the vehicle is held where it is until it is bound again. Who is parked is
        on no lane either, but SUMO's driver knows his way back.
        """
        row = now.index_of.get(vehicle_id)
        off_road = row is not None and now.lane[row] < 0
        off_road = off_road and not self._engine.vehicle.isStoppedParking(vehicle_id)
        driver = self._choosing.free if off_road else self._choosing.world_driver
        self._switching.switch(vehicle_id, self.bound[vehicle_id], driver, now)
        del self.bound[vehicle_id]
        self._forget_lanes(vehicle_id)
        if row is not None and off_road:
            told = "released off the road, where SUMO drives nobody: stands there"
            self._choosing.notes.append((vehicle_id, told))
            self.hold(vehicle_id, now, row)

    def _forget_lanes(self, vehicle_id: str) -> None:
        self._frames.forget(vehicle_id)
        if self._straddling is not None:
            self._straddling.forget(vehicle_id)

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle that SUMO has no longer."""
        self.bound.pop(vehicle_id, None)
        self._held.forget(vehicle_id)
        self._standstill.forget(vehicle_id)
        self._forget_lanes(vehicle_id)
        self._switching.forget(vehicle_id)

    @property
    def is_handing_over(self) -> bool:
        """Return whether a hand-over to SUMO's driver has not ended."""
        return self._switching.is_under_way

    def part(self) -> None:
        """Take back what needs no time: ghosts go, who is held (a wreck, a car off the road) drives on."""
        self.ghosts.drop_lost()
        self.ghosts.show(())
        self._held.let_all_drive(frozenset(self._engine.vehicle.getIDList()))

    def settle(self) -> None:
        """Leave nothing of ours behind: SUMO goes on without us.

        What eases hand-overs is taken back too, so cars beside their lane's centre are on it at once.
        """
        self.part()
        self._switching.settle(frozenset(self._engine.vehicle.getIDList()))

    def after_step(self) -> None:
        """Set right what SUMO's step has left, before anybody reads it."""
        self._standstill.settle()
        self.ghosts.drop_lost()

    def take_notes(self) -> tuple[tuple[str, str], ...]:
        """Return what happened since the last call."""
        notes = tuple(self._choosing.notes)
        self._choosing.notes.clear()
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
        self._held.write(before)
        rows = np.array([before.index_of.get(vehicle_id, -1) for vehicle_id in placement.ids], np.int64)
        ends_route = self._ends.reached(placement, before, rows)
        in_lane = self._in_lane(placement, before, rows)
        leads_on = self._ends.lead_on(placement, before, rows) | ends_route
        along_m = in_lane.position_m - before.lane_position_m[rows]
        exact = is_exact(in_lane, along_m, at_rest=placement.speed_mps == 0.0) & leads_on
        inside = ~(np.abs(in_lane.body_lateral_m) > 0.5 * in_lane.width_m)
        freely = np.zeros(len(rows), np.bool_)
        choosing = self._choosing
        for number, vehicle_id in enumerate(placement.ids):
            binding = self.bound[vehicle_id]
            if rows[number] < 0:
                continue  # SUMO holds it outside the net for the moment
            coupling = choosing.asked_for(
                binding, bool(placement.computer_speed[number]), bool(placement.computer_steering[number])
            )
            if coupling is choosing.mirror:
                coupling = choosing.mirror if binding.choice.mirrors(bool(exact[number])) else choosing.free
                binding.gives_way = ""
            elif coupling is choosing.free:
                binding.gives_way = ""
            else:
                coupling = choosing.possible(
                    vehicle_id,
                    binding,
                    coupling,
                    off_road=before.lane[rows[number]] < 0,
                    outside=not inside[number] and not ends_route[number],
                    reverses=placement.travelled_m[number] < 0.0,
                    leads_on=bool(leads_on[number]),
                )
            on_road = before.lane[rows[number]] >= 0
            if choosing.is_changing_lanes(vehicle_id, binding, coupling) and on_road:
                coupling = choosing.change_ending if coupling is not choosing.car_following else coupling
            self._switching.switch(vehicle_id, binding, coupling, before)
            freely[number] = coupling is choosing.free
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
        self._switching.advance(before)

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
            if rows[number] >= 0 and self._switching.is_on_way_to_centre(name):
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
        own = {self._choosing.lane, self._choosing.mirror}
        return frozenset(name for name, binding in self.bound.items() if binding.coupling in own)

    def learn(self, after: Snapshot) -> None:
        """Place those freely for a while whom SUMO has further from the plant's pose than was foreseen."""
        wrong = (after.placement_error_m > TOLERANCE_M) | (after.placement_error_rad > TOLERANCE_RAD)
        for row in np.flatnonzero(wrong & after.in_lane_frame).tolist():
            binding = self.bound.get(after.ids[row])
            if binding is not None:
                binding.choice.refuse()

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
