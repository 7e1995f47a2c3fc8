"""Snapshots of a SUMO simulation. Direct getters: within libsumo they cost less than subscriptions."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from xgv_cosim.errors import WorldError
from xgv_cosim.snapshot import Collision
from xgv_cosim.worlds.sumo.bodies import Bodies
from xgv_cosim.worlds.sumo.driven import Driven
from xgv_cosim.worlds.sumo.engine import OverSocket, errors_of, for_each, of_each
from xgv_cosim.worlds.sumo.frames import headings_from_sumo
from xgv_cosim.worlds.sumo.ghosts import GHOST_PREFIX, is_ghost
from xgv_cosim.worlds.sumo.integration import TELLING_M
from xgv_cosim.worlds.sumo.lazy_snapshot import Cast, Columns, Happened, LazySnapshot
from xgv_cosim.worlds.sumo.neighbours import NeighbourReader, Scene
from xgv_cosim.worlds.sumo.placing import TOLERANCE_M
from xgv_cosim.worlds.sumo.placing_tables import Way

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from xgv_cosim.columns import FloatColumn, IntColumn
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.sumo.engine import OpenSimulation
    from xgv_cosim.worlds.sumo.handover import HeadingEasing
    from xgv_cosim.worlds.sumo.integration import Integration
    from xgv_cosim.worlds.sumo.neighbours import Nearest
    from xgv_cosim.worlds.sumo.road import SumoRoad
    from xgv_cosim.worlds.sumo.roster import Roster
    from xgv_cosim.worlds.sumo.written import Written

REPORTED_TOLERANCE_MPS = 0.01
"""SUMO is told the true speed where its own differs by more."""
CHECK_STEPS = 10
"""In so many steps SUMO is asked about each bound vehicle whose place it need not be asked for."""
_NOWHERE = Cast((), {}, (), np.zeros(0), np.zeros(0))


_NOT_ASKED = -2
_LANE = int(Way.LANE)
MOST_TELLING = 4
"""So many of those who accelerate are asked for their places in each step, to tell how SUMO integrates."""


class _BoundRows(NamedTuple):
    """Rows of the bound vehicles, as long as these and the cast are the same."""

    bound: tuple[str, ...]
    cast: Cast
    rows: IntColumn


class SnapshotReader:
    """Reads the open simulation into snapshots; keeps what does not change from step to step."""

    def __init__(
        self,
        session: OpenSimulation,
        road: SumoRoad,
        step_s: float,
        bound: Roster,
        integration: Integration,
    ) -> None:
        self._session = session
        self._engine = session.engine
        self._road = road
        self._step_s = step_s
        self._bound = bound
        self._integration = integration
        self._errors = errors_of(session.engine)
        self._is_over_socket = isinstance(session.engine, OverSocket)
        self._is_reading = False
        self._bodies = Bodies(session.engine)
        self._neighbours = NeighbourReader(session.engine, road, self._bodies)
        self._owner_of: Mapping[str, str] = {}
        self._cast = _NOWHERE
        self._present: Sequence[str] = ()
        self._lost: set[str] = set()
        """Who was taken out of SUMO since the last step; whoever has such an id after the next is another."""
        self._bound_rows = _BoundRows((), _NOWHERE, np.zeros(0, np.int64))
        self._onward = np.zeros((2, 0), np.int64)
        """Of each bound vehicle that is there its lane and the one that follows; -2: not asked yet."""
        self._driven: Driven | None = None

    def read(
        self,
        written: Written,
        before: Snapshot | None,
        headings: HeadingEasing,
        notes: Sequence[tuple[str, str]] = (),
        owner_of: Mapping[str, str] | None = None,
    ) -> LazySnapshot:
        """Return the present state without ghosts, as the plant has its vehicles.

        Args:
            written: What was written before the step.
            before: The snapshot before it; None: this is the first.
            headings: Turns cars to their lanes by and by, for whom the world's driver steers.
            notes: What the snapshot has to tell.
            owner_of: Ghost -> the vehicle that it stands for.
        """
        self._owner_of = owner_of or {}
        self._driven, self._is_reading = None, True
        happened = self._happened(notes)
        cast = self._cast
        columns = Columns(len(cast.ids))
        rows = cast.rows_of(written.placement.ids)
        in_frame = np.zeros(len(cast.ids), np.bool_)
        here = rows >= 0
        in_frame[rows[here & written.in_lane_frame]] = True
        snapshot = LazySnapshot(cast, happened, columns, in_frame, self)
        if before is not None and len(rows):
            self._fill_in(written, rows, columns, before, headings, snapshot)
        self._fill_next_lanes(snapshot, columns)
        self._is_reading = False
        return snapshot

    @contextmanager
    def _answers(self) -> Iterator[None]:
        """Make a refusal of SUMO an error of this reading alone: a script may have removed a vehicle.

        Raises:
            WorldError: SUMO refused the answer.
        """
        try:
            yield
        except self._errors as error:
            if self._is_reading:  # within the world's step, which ends with it
                raise
            raise WorldError(f"SUMO cannot tell of the last step any more: {error}") from error

    def _happened(self, notes: Sequence[tuple[str, str]]) -> Happened:
        """Ask SUMO what it did, and who is there."""
        simulation = self._engine.simulation
        arrived = _vehicles(simulation.getArrivedIDList())
        for vehicle_id in arrived:
            self._forget(vehicle_id)
        teleported = _vehicles(simulation.getStartingTeleportIDList())
        collisions = tuple(
            Collision(contact.collider, contact.victim, contact.type, contact.lane, contact.pos)
            for contact in simulation.getCollisions()
            if not (is_ghost(contact.collider) or is_ghost(contact.victim))
        )
        departed: tuple[str, ...] = ()
        present = self._engine.vehicle.getIDList()
        if present != self._present or self._lost:
            self._present, ids = present, _vehicles(present)
            # SUMO's own list of departures lacks who came with a loaded state or returns from a teleport
            known, lost = self._cast.index_of, self._lost
            departed = tuple(name for name in ids if name not in known or name in lost)
            if ids != self._cast.ids or self._lost:
                self._cast = self._new_cast(ids)
            self._lost.clear()
        time_s = round(simulation.getTime() - self._session.begin_s, 3)  # SUMO counts milliseconds
        left = tuple("" if name in arrived else self._edge_left_by(name) for name in teleported)
        return Happened(time_s, departed, arrived, teleported, left, collisions, tuple(notes))

    def _edge_left_by(self, vehicle_id: str) -> str:
        """Return from which edge a vehicle was taken in this step: SUMO has it on the next one already."""
        vehicle = self._engine.vehicle
        edge: str = vehicle.getRoute(vehicle_id)[max(vehicle.getRouteIndex(vehicle_id) - 1, 0)]
        return edge

    def _new_cast(self, ids: tuple[str, ...]) -> Cast:
        bodies = [self._bodies.of(name) for name in ids]
        return Cast(
            ids,
            {name: row for row, name in enumerate(ids)},
            tuple(body.type_id for body in bodies),
            np.array([body.length_m for body in bodies], np.float64),
            np.array([body.width_m for body in bodies], np.float64),
        )

    def lose(self, vehicle_id: str) -> None:
        """Ask SUMO no more about a vehicle that it has lost."""
        self._lost.add(vehicle_id)
        self._forget(vehicle_id)
        if self._driven is not None:
            self._driven = self._driven.without(vehicle_id)

    def _forget(self, vehicle_id: str) -> None:
        self._bodies.forget(vehicle_id)
        self._neighbours.forget(vehicle_id)

    def _fill_in(
        self,
        written: Written,
        rows: IntColumn,
        columns: Columns,
        before: Snapshot,
        headings: HeadingEasing,
        snapshot: LazySnapshot,
    ) -> None:
        """Fill in what is known of the placed vehicles, and ask SUMO for what is not."""
        placement, is_here = written.placement, rows >= 0
        posed = (written.is_posed & is_here).nonzero()[0]
        at = rows[posed]
        columns.x_m[at], columns.y_m[at] = placement.front_x_m[posed], placement.front_y_m[posed]
        columns.heading_rad[at] = placement.heading_rad[posed]
        columns.has_pose[at] = True
        self._driven = Driven(placement, rows)
        driven = (placement.computer_speed & is_here).nonzero()[0]
        in_frame = written.in_lane_frame[driven] & ~np.bool_(self._integration.is_ballistic)
        sumos_mps = np.maximum(placement.speed_mps, 0.0)[driven]
        sumos_mps[in_frame] = written.along_m[driven[in_frame]] / self._step_s
        told = (~(written.is_posed[driven] | in_frame)).nonzero()[0]
        sumos_mps[told] = snapshot.of("speed_mps", rows[driven[told]])
        self._tell_speeds(placement.ids, driven, placement.speed_mps[driven], sumos_mps)
        columns.speed_mps[rows[driven]] = placement.speed_mps[driven]
        columns.accel_mps2[rows[driven]] = 0.0  # of who comes back from nowhere; else:
        onward = driven[written.rows_before[driven] >= 0]
        gained_mps = placement.speed_mps[onward] - before.of("speed_mps", written.rows_before[onward])
        columns.accel_mps2[rows[onward]] = gained_mps / self._step_s
        columns.has_motion[rows[driven]] = True
        along_lane = self._fill_places(written, rows, columns, snapshot)
        self._fill_poses(written, rows, columns, along_lane)
        steered = rows[is_here & placement.computer_steering]
        turned = columns.has_pose[steered]
        if not turned.all():
            snapshot.of("heading_rad", steered)
            columns.heading_rad[steered] = placement.heading_rad[is_here & placement.computer_steering]
        if headings.is_at_work:
            easing = headings.rows_in(snapshot.index_of)
            snapshot.of("heading_rad", easing)
            headings.eased(before, snapshot.index_of, columns.heading_rad)

    def _fill_poses(self, written: Written, rows: IntColumn, columns: Columns, along_lane: IntColumn) -> None:
        """Fill in the poses of those who were moved in their lanes: they follow from their places there."""
        moved = along_lane[written.way[along_lane] == _LANE]
        if not len(moved):
            return
        at, lateral_m = rows[moved], written.found["lateral_m"][moved]
        centre = self._road.points_ahead(columns.lane[at], columns.position_m[at], np.full(len(at), -1))
        columns.x_m[at] = centre.x_m - lateral_m * np.sin(centre.heading_rad)
        columns.y_m[at] = centre.y_m + lateral_m * np.cos(centre.heading_rad)
        columns.heading_rad[at] = written.placement.heading_rad[moved]
        columns.has_pose[at] = True

    def _tell_speeds(
        self, ids: Sequence[str], driven: IntColumn, true_mps: FloatColumn, sumos_mps: FloatColumn
    ) -> None:
        """Tell SUMO the speed at the end of the step where it has another, so that its drivers see that one.

        In the frame of a lane SUMO's speed is the mean of the step (unless it integrates ballistically);
        reverse it does not know at all.
        Measured: the next step is not disturbed by it.
        """
        shown_mps = np.maximum(true_mps, 0.0)
        wrong = np.abs(shown_mps - sumos_mps) > REPORTED_TOLERANCE_MPS
        names = [ids[number] for number in driven[wrong].tolist()]
        for_each(self._engine.vehicle.setPreviousSpeed, names, shown_mps[wrong].tolist())

    def _fill_places(
        self, written: Written, rows: IntColumn, columns: Columns, snapshot: LazySnapshot
    ) -> IntColumn:
        """Fill in lanes and positions that follow from what was written; ask SUMO for the others.

        Some of the first are asked for all the same, in turn, and of some who accelerate: SUMO has the
        last word.

        Returns:
            Whose place was not asked for.
        """
        lane = written.seen.lane
        length_m = self._road.lane_length_m(lane)
        known, at_m = written.places(length_m, self._road.inside_junction[lane])
        known &= rows >= 0
        in_turn = (np.arange(len(rows)) + round(snapshot.time_s / self._step_s)) % CHECK_STEPS == 0
        otherwise_m = self._integration.otherwise_m(written.along_m, written.seen.speed_mps)
        telling = written.in_lane_frame & (np.abs(otherwise_m) > TELLING_M)
        in_turn[telling.nonzero()[0][:MOST_TELLING]] = True
        asked = rows[(rows >= 0) & ~(known & ~in_turn)]
        snapshot.of("lane", asked)
        checked = (known & in_turn).nonzero()[0]
        if len(checked):
            self._check(written, rows, columns, checked, at_m, otherwise_m)
        if self._is_over_socket:  # the same questions after every step travel in one message
            spare = Columns(len(snapshot.ids))
            self.read_places(self._cast, spare, rows[known & ~in_turn].tolist())
        plain: IntColumn = (known & ~in_turn).nonzero()[0]
        columns.lane[rows[plain]], columns.position_m[rows[plain]] = lane[plain], at_m[plain]
        columns.has_place[rows[plain]] = True
        return plain

    def _check(
        self,
        written: Written,
        rows: IntColumn,
        columns: Columns,
        checked: IntColumn,
        at_m: FloatColumn,
        otherwise_m: FloatColumn,
    ) -> None:
        """Have those placed freely for a while whom SUMO has elsewhere in the lane than was foreseen."""
        checked = checked[written.in_lane_frame[checked]]
        row = rows[checked]
        in_lane = columns.lane[row] == written.seen.lane[checked]
        further_m = columns.position_m[row] - at_m[checked]
        self._integration.learn(further_m[in_lane], otherwise_m[checked[in_lane]])
        for number in checked[~in_lane | (np.abs(further_m) > TOLERANCE_M)].tolist():
            self._bound.refuse_mirror(written.placement.ids[number])

    def rows_of_bound(self, cast: Cast) -> IntColumn:
        """Return the rows of the bound vehicles that are there, in the order of the roster."""
        known = self._bound_rows
        if known.cast is not cast or known.bound != self._bound.ids:
            here = [name for name in self._bound.ids if name in cast.index_of]
            before = {known.cast.ids[row]: place for place, row in enumerate(known.rows.tolist())}
            onward = np.full((2, len(here)), _NOT_ASKED)
            for place, name in enumerate(here):
                if name in before:
                    onward[:, place] = self._onward[:, before[name]]
            rows = np.array([cast.index_of[name] for name in here], np.int64)
            self._onward, self._bound_rows = onward, _BoundRows(self._bound.ids, cast, rows)
        return self._bound_rows.rows

    def _fill_next_lanes(self, snapshot: LazySnapshot, columns: Columns) -> None:
        """Fill in the lanes that follow on the routes of the bound vehicles."""
        rows = self.rows_of_bound(self._cast)
        lane, ids = snapshot.of("lane", rows), snapshot.ids
        for place in np.flatnonzero(lane != self._onward[0]).tolist():
            self._onward[1, place] = self._next_lane(ids[rows[place]], int(lane[place]))
        self._onward[0] = lane
        columns.next_lane[rows] = self._onward[1]

    def _next_lane(self, vehicle_id: str, lane: int) -> int:
        if lane < 0:
            return -1
        vehicle = self._engine.vehicle
        route, index = vehicle.getRoute(vehicle_id), vehicle.getRouteIndex(vehicle_id)
        following = route[index + 1] if index + 1 < len(route) else ""
        return self._road.next_lane(lane, following)

    def read_poses(self, cast: Cast, columns: Columns, rows: list[int]) -> None:
        """Fill in places and headings."""
        with self._answers():
            vehicle, ids = self._engine.vehicle, [cast.ids[row] for row in rows]
            if rows:
                columns.x_m[rows], columns.y_m[rows] = np.array(of_each(vehicle.getPosition, ids)).T
                columns.heading_rad[rows] = headings_from_sumo(np.array(of_each(vehicle.getAngle, ids)))

    def read_motions(self, cast: Cast, columns: Columns, rows: list[int]) -> None:
        """Fill in speeds and accelerations."""
        with self._answers():
            vehicle, ids = self._engine.vehicle, [cast.ids[row] for row in rows]
            columns.speed_mps[rows] = of_each(vehicle.getSpeed, ids)
            columns.accel_mps2[rows] = of_each(vehicle.getAcceleration, ids)

    def read_places(self, cast: Cast, columns: Columns, rows: list[int]) -> None:
        """Fill in lanes and positions along them."""
        with self._answers():
            vehicle, number, ids = self._engine.vehicle, self._road.index_of, [cast.ids[row] for row in rows]
            columns.lane[rows] = [number[lane] for lane in of_each(vehicle.getLaneID, ids)]
            columns.position_m[rows] = of_each(vehicle.getLanePosition, ids)
            columns.position_m[rows] = np.where(columns.lane[rows] >= 0, columns.position_m[rows], 0.0)

    def leaders(self, cast: Cast, lane: IntColumn, position_m: FloatColumn) -> Nearest:
        """Return who is before the bound vehicles."""
        with self._answers():
            return self._neighbours.leaders(self._scene(cast, lane, position_m))

    def followers(self, cast: Cast, lane: IntColumn, position_m: FloatColumn) -> Nearest:
        """Return who is behind them."""
        with self._answers():
            return self._neighbours.followers(self._scene(cast, lane, position_m))

    def _scene(self, cast: Cast, lane: IntColumn, position_m: FloatColumn) -> Scene:
        here = [cast.ids[row] for row in self.rows_of_bound(cast).tolist()]
        return Scene(cast.index_of, lane, position_m, here, self._owner_of)

    def placement_errors(self, cast: Cast) -> tuple[FloatColumn, FloatColumn]:
        """Return distance and turn of SUMO's poses from the plant's; 0 where a driver of SUMO's moves."""
        with self._answers():
            if self._driven is None:
                distance_m, turned_rad = np.zeros((2, len(cast.ids)))
                return distance_m, turned_rad
            return self._driven.errors(self._engine, len(cast.ids))


def _vehicles(ids: Iterable[str]) -> tuple[str, ...]:
    """Return the ids without those of ghosts."""
    return tuple([name for name in ids if not name.startswith(GHOST_PREFIX)])
