"""The bound vehicles of a SUMO world: which coupling writes each of them, in each step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from xgv_cosim.worlds.sumo.choosing import Couplings, told
from xgv_cosim.worlds.sumo.couplings import Targets
from xgv_cosim.worlds.sumo.ghosts import Ghosts
from xgv_cosim.worlds.sumo.held import Held
from xgv_cosim.worlds.sumo.integration import Integration
from xgv_cosim.worlds.sumo.lane_change_ending import LaneChangeEnding
from xgv_cosim.worlds.sumo.lane_frame import LaneFrame
from xgv_cosim.worlds.sumo.placing import Decided, decide
from xgv_cosim.worlds.sumo.placing_tables import Seen, Wanted, Way, Yields
from xgv_cosim.worlds.sumo.roster import Roster
from xgv_cosim.worlds.sumo.route_ends import RouteEnds
from xgv_cosim.worlds.sumo.shadows import Shadows
from xgv_cosim.worlds.sumo.standstill import Standstill, period_s
from xgv_cosim.worlds.sumo.straddling import Owners, Straddling
from xgv_cosim.worlds.sumo.switching import Switching
from xgv_cosim.worlds.sumo.written import Written, nothing_written

if TYPE_CHECKING:
    from collections.abc import Collection

    from xgv_cosim.actuation import CouplingKind
    from xgv_cosim.columns import BoolColumn, IntColumn, UInt8Column
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.base import Placement
    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.handover import HeadingEasing
    from xgv_cosim.worlds.sumo.lane_table import Table
    from xgv_cosim.worlds.sumo.road import SumoRoad

_NONE, _FREE = np.uint8(Way.NONE), np.uint8(Way.FREE)
_PLACED_ACROSS = np.isin(np.arange(len(Way)), (Way.FREE, Way.LANE, Way.CAR_FOLLOWING))
"""By ``Way``: whose shadow is cleared. Not of the mirrored: it would turn them, and free ones come before."""

TELLING_STEPS = 10
"""Every so many steps SUMO is told again how far a vehicle is across its lane, though that has not changed: a
script may have told it otherwise. Counted by row, so it may take longer while others come and go."""
_TURNED_RAD = 0.003
"""SUMO has a vehicle along its lane that is turned no further; with a lane change it turns by degrees."""


class Bindings:
    """Writes every bound vehicle with the coupling that its ownership asks for."""

    def __init__(self, engine: Engine, road: SumoRoad, step_s: float, *, with_ghosts: bool = True) -> None:
        self.bound = Roster()
        self._engine = engine
        self._step_s = step_s
        self._road = road
        self._tables = road.tables
        self._notes: list[tuple[str, str]] = []
        self.integration = Integration.of(engine, step_s)
        """How far SUMO moves a vehicle with the speeds that it is given."""
        self._couplings = Couplings(LaneFrame(engine, self.integration, road.leftwards))
        self._switching = Switching(engine, road, step_s, self._couplings)
        self._lane_changes = LaneChangeEnding(engine)
        self._ends = RouteEnds(engine, road, step_s)
        self._straddling = Straddling(road) if with_ghosts else None
        self._standstill = Standstill(engine, step_s, period_s(engine))
        self._shadows = Shadows(engine, road)
        self._held = Held(engine, self._couplings.free, self._standstill)
        self.written = nothing_written()
        """What the last step wrote."""
        self._num_steps = 0
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
        self._ends.forget(vehicle_id)
        self.bound.add(vehicle_id, kind)

    def give_back(self, vehicle_id: str, now: Snapshot) -> None:
        """Leave a vehicle to SUMO's driver for good.

        Off the road SUMO drives nobody: it would keep the vehicle on its list of teleports and never bring
        it back (measured). There the vehicle is held where it is until it is bound again. Who is parked is
        on no lane either, but SUMO's driver knows his way back.
        """
        row = now.index_of.get(vehicle_id)
        off_road = row is not None and now.value("lane", row) < 0
        off_road = off_road and not self._engine.vehicle.isStoppedParking(vehicle_id)
        before, after = self.bound.way_of(vehicle_id), Way.FREE if off_road else Way.WORLD_DRIVER
        if before is not after:
            self._switching.switch(vehicle_id, before, after, now)
        self.bound.remove(vehicle_id)
        if row is not None and off_road:
            told_of = "released off the road, where SUMO drives nobody: stands there"
            self._notes.append((vehicle_id, told_of))
            self.hold(vehicle_id, now, row)

    def forget(self, vehicle_id: str) -> None:
        """Drop a vehicle that SUMO has no longer."""
        self.bound.remove(vehicle_id)
        self._held.forget(vehicle_id)
        self._standstill.forget(vehicle_id)
        self._switching.forget(vehicle_id)

    @property
    def is_handing_over(self) -> bool:
        """Return whether a hand-over to SUMO's driver has not ended."""
        return self._switching.is_under_way or self._held.is_returning

    def part(self) -> None:
        """Take back what needs no time: ghosts go, wrecks drive on, cars off the road with the next step."""
        self.ghosts.settle()
        self.ghosts.show(())
        self._held.let_all_drive(frozenset(self._engine.vehicle.getIDList()))

    def settle(self) -> None:
        """Leave nothing of ours behind: SUMO goes on without us.

        What eases hand-overs is taken back too, so cars beside their lane's centre are on it at once.
        """
        self.part()
        self._switching.settle(frozenset(self._engine.vehicle.getIDList()))

    def bring_back(self) -> None:
        """Have cars that wait off the road on it again: SUMO makes a step next, without us."""
        self._held.bring_back(frozenset(self._engine.vehicle.getIDList()))

    def after_step(self) -> None:
        """Set right what SUMO's step has left, before anybody reads it."""
        self._standstill.settle()
        self._lane_changes.settle()
        self.ghosts.settle()

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
        roster = self.bound.in_order_of(placement.ids)
        self.written = nothing_written()
        if not before.ids:
            return
        self._num_steps += 1
        roster["told_lane"][self._num_steps % TELLING_STEPS :: TELLING_STEPS] = -1
        self._held.write(before)
        rows = before.rows_of(placement.ids)
        seen = self._seen(placement, before, rows)
        wanted = Wanted(*placement[1:])
        decided = decide(self._tables, roster, seen, wanted, self._step_s, self._standstill.period_s)
        self._switch(placement, before, rows, roster, seen, decided)
        if decided.replans:
            self._replan(placement, roster, seen, decided.found)
        ways = self._ways(placement, before, rows, roster, seen, decided)
        self._clear_shadows(placement, roster, ways, seen)
        for way, count in enumerate(np.bincount(ways).tolist()):
            if way and count:
                chosen = (ways == way).nonzero()[0]
                targets = _targets(placement, decided.found, seen.ends_route, chosen)
                self._couplings.by_way[Way(way)].write(targets)
        self.written = Written(placement, rows, ways, decided.found, seen)
        self._show_ghosts(placement, before, rows, roster, decided)
        if decided.may_change_lane:  # after switches and ghosts: it gives a vehicle a type of its own
            for number in np.flatnonzero(roster["changes_lane"]).tolist():
                self._lane_changes.quicken(placement.ids[number])
        self._switching.advance(before)

    def _switch(
        self,
        placement: Placement,
        before: Snapshot,
        rows: IntColumn,
        roster: Table,
        seen: Seen,
        decided: Decided,
    ) -> None:
        """Tell of couplings that give way, and prepare SUMO for who is written in another way than last."""
        found = decided.found
        if decided.tells:
            for number in np.flatnonzero(found["tells"]).tolist():
                self._notes.append((placement.ids[number], told(Yields(roster["yields"][number]))))
        if decided.may_change_lane:
            for number in np.flatnonzero(found["may_change_lane"]).tolist():
                if seen.lane[number] >= 0:
                    heading_rad = before.value("heading_rad", int(rows[number]))
                    self._see_lane_change(placement.ids[number], roster, found, number, seen, heading_rad)
        if decided.switches or decided.may_change_lane:
            for number in np.flatnonzero(seen.is_here & (found["way"] != roster["way"])).tolist():
                was, now = Way(roster["way"][number]), Way(found["way"][number])
                self._switching.switch(placement.ids[number], was, now, before)
            roster["way"] = found["way"]

    def _replan(self, placement: Placement, roster: Table, seen: Seen, found: Table) -> None:
        """Have SUMO plan for vehicles as for ones that stop at red lights, or that may pass them."""
        changed = seen.is_here & (found["stops_at_red"] != roster["stops_at_red"])
        for number in np.flatnonzero(changed).tolist():
            stops_at_red = bool(found["stops_at_red"][number])
            self._switching.replan(
                placement.ids[number], Way(found["way"][number]), stops_at_red=stops_at_red
            )
        roster["stops_at_red"] = found["stops_at_red"]

    def _ways(
        self,
        placement: Placement,
        before: Snapshot,
        rows: IntColumn,
        roster: Table,
        seen: Seen,
        decided: Decided,
    ) -> UInt8Column:
        """Return the way to write each; ``NONE``: it is not there, or is kept from waiting instead."""
        ways: UInt8Column = np.where(seen.is_here, decided.found["way"], _NONE)
        if decided.rests:
            stirred = seen.is_here & (roster["rest_steps"] * self._step_s >= self._standstill.period_s)
            for number in np.flatnonzero(stirred).tolist():
                self._stir(placement.ids[number], before, int(rows[number]))
            roster["rest_steps"][stirred] = 0
            roster["told_lane"][stirred] = -1
            ways[stirred] = _NONE
        return ways

    def _clear_shadows(self, placement: Placement, roster: Table, ways: UInt8Column, seen: Seen) -> None:
        """Take away what SUMO leaves in the lane beside of those who have come onto another lane."""
        placed = _PLACED_ACROSS[ways] & ~roster["changes_lane"]  # only then is it known what is left
        entered = np.flatnonzero(placed & (roster["cleared_lane"] != seen.lane))
        if not len(entered):
            return
        self._shadows.clear(
            [placement.ids[number] for number in entered.tolist()], seen.lane[entered].tolist()
        )
        roster["cleared_lane"][entered] = seen.lane[entered]

    def _seen(self, placement: Placement, before: Snapshot, rows: IntColumn) -> Seen:
        """Return the placed vehicles as SUMO has them before the step."""
        is_here = rows >= 0
        lane, next_lane = before.of("lane", rows), before.of("next_lane", rows)
        if not is_here.all():
            lane, next_lane = np.where(is_here, lane, -1), np.where(is_here, next_lane, -1)
        position_m = before.of("lane_position_m", rows)
        return Seen(
            is_here,
            lane,
            next_lane,
            position_m,
            before.of("speed_mps", rows),
            before.length_m[rows],
            before.width_m[rows],
            self._ends.reached(placement, lane, next_lane, position_m),
        )

    def _see_lane_change(
        self,
        vehicle_id: str,
        roster: Table,
        found: Table,
        number: int,
        seen: Seen,
        heading_rad: float,
    ) -> None:
        """Place those freely whom SUMO's driver was to bring onto another lane when he lost the wheel.

        Who has just been brought there is turned still, as SUMO has it, and cannot be mirrored yet either.
        """
        changes = self._engine.vehicle.getLateralSpeed(vehicle_id) != 0.0
        roster["changes_lane"][number] = changes
        if changes:
            found["way"][number] = Way.FREE
            roster["cleared_lane"][number] = -1
        ends_m = seen.position_m[number] - np.array([0.0, seen.length_m[number]])
        lane = np.full(2, seen.lane[number])
        line = self._road.points_ahead(lane, ends_m, np.full(2, -1, np.int64))
        along_rad = np.arctan2(line.y_m[0] - line.y_m[1], line.x_m[0] - line.x_m[1])
        turned_rad = (heading_rad - along_rad + np.pi) % (2.0 * np.pi) - np.pi
        if changes or abs(turned_rad) > _TURNED_RAD:
            roster["since_change_m"][number] = 0.0
            roster["exact_steps"][number] = 0

    def _stir(self, vehicle_id: str, before: Snapshot, row: int) -> None:
        self._standstill.stir(vehicle_id, *before.pose_of(row))

    def _show_ghosts(
        self, placement: Placement, before: Snapshot, rows: IntColumn, roster: Table, decided: Decided
    ) -> None:
        """Have ghosts where bodies reach into further lanes; SUMO's own driver sees to his lane changes."""
        if self._straddling is None:
            return
        by_plant, shown = placement.computer_steering, placement
        easing, found = self._switching.on_way_to_centre, decided.found
        if not (easing or decided.reaches_out):
            self.ghosts.show(())
            return
        if easing:
            by_plant, shown = _with_easing(easing, placement, before, rows, self._step_s)
        owners = Owners(by_plant, found["way"] == _FREE)
        self.ghosts.show(
            self._straddling.reaches(shown, before, rows, roster, found, owners, self.ghosts.standing)
        )


def _with_easing(
    easing: Collection[str], placement: Placement, before: Snapshot, rows: IntColumn, step_s: float
) -> tuple[BoolColumn, Placement]:
    """Return whose place across the lane is ours, and where they are, with those on their way to the centre.

    These are their driver's, but SUMO does not know of this way across the line.
    """
    by_plant = placement.computer_steering.copy()
    x_m, y_m, heading_rad = (column.copy() for column in placement[1:4])
    for number, name in enumerate(placement.ids):
        if rows[number] >= 0 and name in easing:
            by_plant[number] = True
            row = int(rows[number])
            front_x_m, front_y_m, heading_rad[number] = before.pose_of(row)
            way_m = before.value("speed_mps", row) * step_s
            x_m[number] = front_x_m + way_m * np.cos(heading_rad[number])
            y_m[number] = front_y_m + way_m * np.sin(heading_rad[number])
    return by_plant, placement._replace(front_x_m=x_m, front_y_m=y_m, heading_rad=heading_rad)


def _targets(placement: Placement, found: Table, ends_route: BoolColumn, chosen: IntColumn) -> Targets:
    """Return what is wanted of some of the placed vehicles."""
    everybody = len(chosen) == len(placement.ids)
    which = slice(None) if everybody else chosen
    return Targets(
        placement.ids if everybody else [placement.ids[number] for number in chosen.tolist()],
        placement.front_x_m[which],
        placement.front_y_m[which],
        placement.heading_rad[which],
        placement.speed_mps[which],
        placement.travelled_m[which],
        found["along_m"][which],
        found["lateral_m"][which],
        found["shifts"][which],
        ends_route[which],
    )
