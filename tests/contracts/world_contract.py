"""What every world has to do. A world's test class inherits ``WorldContract`` and builds the world."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np
import pytest

from xgv_cosim.actuation import CouplingKind
from xgv_cosim.errors import WorldError
from xgv_cosim.snapshot import Snapshot
from xgv_cosim.worlds.base import Placement, World

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

SNAPSHOT_LISTS = {"time_s", "departed", "arrived", "teleported", "teleported_from", "collisions", "notes"}
"""What of a snapshot is no column."""


def nobody() -> Placement:
    """Return the placement of no vehicle."""
    none = np.zeros(0)
    return Placement((), none, none, none, none, none, none.astype(np.bool_), none.astype(np.bool_))


def place(
    vehicle_id: str,
    x_m: float,
    y_m: float,
    heading_rad: float,
    *,
    speed_mps: float,
    travelled_m: float,
    computer: tuple[bool, bool] = (True, True),
) -> Placement:
    """Return the placement of one vehicle; ``computer`` says whether the plant has (speed, steering)."""
    columns = [np.array([value]) for value in (x_m, y_m, heading_rad, speed_mps, travelled_m)]
    return Placement((vehicle_id,), *columns, *(np.array([axis]) for axis in computer))


def stay(snapshot: Snapshot, vehicle_id: str, computer: tuple[bool, bool] = (True, True)) -> Placement:
    """Return the placement of a vehicle that stands where it is."""
    row = snapshot.index_of[vehicle_id]
    return place(
        vehicle_id,
        float(snapshot.front_x_m[row]),
        float(snapshot.front_y_m[row]),
        float(snapshot.heading_rad[row]),
        speed_mps=0.0,
        travelled_m=0.0,
        computer=computer,
    )


def ahead(snapshot: Snapshot, vehicle_id: str, speed_mps: float, step_s: float) -> Placement:
    """Return the placement of a vehicle that goes on in its own direction."""
    row = snapshot.index_of[vehicle_id]
    heading, way_m = float(snapshot.heading_rad[row]), speed_mps * step_s
    return place(
        vehicle_id,
        float(snapshot.front_x_m[row] + way_m * np.cos(heading)),
        float(snapshot.front_y_m[row] + way_m * np.sin(heading)),
        heading,
        speed_mps=speed_mps,
        travelled_m=way_m,
    )


class WorldContract(ABC):
    """Inherit and implement ``new_world``.

    The world has ``ego`` and in its lane one vehicle ahead and one behind. After the first step all
    three drive, at 5 m/s or more, at least 30 m apart and at least 100 m from the end of the road.
    """

    ego = "ego"
    step_s = 0.1

    @abstractmethod
    def new_world(self, folder: Path) -> World:
        """Return the world, not started; ``folder`` is empty and may be written to."""

    @pytest.fixture
    def world(self, tmp_path: Path) -> Iterator[World]:
        world = self.new_world(tmp_path)
        yield world
        world.close()

    @pytest.fixture
    def moving(self, world: World) -> Snapshot:
        world.start()
        snapshot = world.step(nobody())
        snapshot.read_all()
        return snapshot

    def test_time_begins_at_zero_and_advances_by_the_step(self, world: World) -> None:
        times = [world.start().time_s, *(world.step(nobody()).time_s for _ in range(3))]
        assert times == [0.0, 0.1, 0.2, 0.3]

    def test_columns_have_one_entry_per_vehicle(self, moving: Snapshot) -> None:
        assert len(moving.ids) >= 3
        for column in fields(Snapshot):
            if column.name not in SNAPSHOT_LISTS:
                assert len(getattr(moving, column.name)) == len(moving.ids), column.name

    def test_it_tells_who_a_vehicle_is(self, world: World, moving: Snapshot) -> None:
        for name, type_id in zip(moving.ids, moving.type_ids, strict=True):
            who = world.traveller(name)
            assert (who.vehicle_id, who.type_id) == (name, type_id)

    def test_vehicles_lie_on_the_lane_that_the_road_tells(self, world: World, moving: Snapshot) -> None:
        points = world.road.points_ahead(moving.lane, moving.lane_position_m, moving.next_lane)
        away_m = np.hypot(points.x_m - moving.front_x_m, points.y_m - moving.front_y_m)
        assert (moving.lane >= 0).all()
        assert away_m.max() < 0.05
        assert (away_m < world.road.lane_width_m(moving.lane)).all()

    def test_points_of_a_lane_lie_on_its_shape(self, world: World, moving: Snapshot) -> None:
        lane = int(moving.lane[moving.index_of[self.ego]])
        shape, lanes = world.road.lane_shape_m(lane), np.array([lane, lane])
        ends = world.road.points_ahead(
            lanes, np.array([0.0, world.road.lane_length_m(lanes)[0]]), np.array([-1, -1])
        )
        np.testing.assert_allclose(np.column_stack([ends.x_m, ends.y_m]), shape[[0, -1]], atol=1e-6)

    def test_free_coupling_places_exactly_where_asked(self, world: World, moving: Snapshot) -> None:
        world.bind(self.ego, CouplingKind.FREE)
        row = moving.index_of[self.ego]
        x_m, y_m = float(moving.front_x_m[row]) + 0.4, float(moving.front_y_m[row]) + 0.3
        heading = float(moving.heading_rad[row]) + 0.05
        after = world.step(place(self.ego, x_m, y_m, heading, speed_mps=3.21, travelled_m=0.5))
        row = after.index_of[self.ego]
        got = [
            column[row] for column in (after.front_x_m, after.front_y_m, after.heading_rad, after.speed_mps)
        ]
        np.testing.assert_allclose(got, [x_m, y_m, heading, 3.21], atol=1e-9)

    def test_reverse_is_reported_as_a_negative_speed(self, world: World, moving: Snapshot) -> None:
        world.bind(self.ego, CouplingKind.FREE)
        after = world.step(ahead(moving, self.ego, -1.0, self.step_s))
        assert after.speed_mps[after.index_of[self.ego]] == pytest.approx(-1.0)

    def test_gaps_are_bumper_to_bumper(self, world: World, moving: Snapshot) -> None:
        world.bind(self.ego, CouplingKind.FREE)
        after = world.step(ahead(moving, self.ego, 5.0, self.step_s))
        row = after.index_of[self.ego]
        leader, follower = int(after.leader[row]), int(after.follower[row])
        front = after.lane_position_m
        assert leader >= 0
        assert follower >= 0
        assert after.leader_gap_m[row] == pytest.approx(
            front[leader] - after.length_m[leader] - front[row], abs=0.02
        )
        assert after.follower_gap_m[row] == pytest.approx(
            front[row] - after.length_m[row] - front[follower], abs=0.02
        )

    def test_neighbours_are_told_for_bound_vehicles_only(self, world: World, moving: Snapshot) -> None:
        assert (moving.leader == -1).all()
        assert np.isinf(moving.leader_gap_m).all()
        assert np.isinf(moving.follower_gap_m).all()

    def test_a_vehicle_that_the_driver_has_moves_by_itself(self, world: World, moving: Snapshot) -> None:
        world.bind(self.ego, CouplingKind.FREE)
        after = moving
        for _ in range(5):
            after = world.step(stay(after, self.ego, computer=(False, False)))
        row = after.index_of[self.ego]
        assert after.speed_mps[row] > 1.0
        assert after.lane_position_m[row] > moving.lane_position_m[moving.index_of[self.ego]] + 0.5

    def test_a_released_vehicle_goes_back_to_the_worlds_driver(self, world: World, moving: Snapshot) -> None:
        world.bind(self.ego, CouplingKind.FREE)
        stopped = moving
        for _ in range(3):
            stopped = world.step(stay(stopped, self.ego))
        world.release(self.ego)
        after = stopped
        for _ in range(20):
            after = world.step(nobody())
        assert after.speed_mps[after.index_of[self.ego]] > 1.0
        with pytest.raises(WorldError, match="not bound"):
            world.release(self.ego)

    def test_an_immobilised_vehicle_stays_until_it_is_bound(self, world: World, moving: Snapshot) -> None:
        row = moving.index_of[self.ego]
        place_of = ("front_x_m", "front_y_m", "heading_rad")
        at = [getattr(moving, name)[row] for name in place_of]
        world.immobilise(self.ego)
        for _ in range(20):
            after = world.step(nobody())
            row = after.index_of[self.ego]
            assert [getattr(after, name)[row] for name in place_of] == pytest.approx(at, abs=1e-9)
            assert after.speed_mps[row] == 0.0
        world.bind(self.ego, CouplingKind.FREE)
        with pytest.raises(WorldError, match="is bound"):
            world.immobilise(self.ego)
        after = world.step(ahead(after, self.ego, 5.0, self.step_s))
        assert after.front_x_m[after.index_of[self.ego]] != pytest.approx(at[0], abs=0.1)

    def test_binding_is_checked(self, world: World, moving: Snapshot) -> None:
        with pytest.raises(WorldError, match="no vehicle 'ghost'"):
            world.bind("ghost", CouplingKind.FREE)
        with pytest.raises(WorldError, match="'ego' is placed but not bound"):
            world.step(stay(moving, self.ego))
        with pytest.raises(WorldError, match="not bound"):
            world.set_coupling(self.ego, CouplingKind.LANE)
        world.bind(self.ego, CouplingKind.FREE)
        with pytest.raises(WorldError, match="bound already"):
            world.bind(self.ego, CouplingKind.FREE)

    def test_a_second_start_is_refused(self, world: World, moving: Snapshot) -> None:
        with pytest.raises(WorldError, match="close"):
            world.start()
        assert world.step(nobody()).time_s == 0.2

    def test_close_ends_the_world_and_start_begins_anew(self, world: World, moving: Snapshot) -> None:
        world.close()
        world.close()
        with pytest.raises(WorldError, match="closed"):
            world.step(nobody())
        assert world.start().time_s == 0.0
        again = world.step(nobody())
        assert again.ids == moving.ids
        np.testing.assert_array_equal(again.front_x_m, moving.front_x_m)

    def test_two_runs_are_identical_to_the_last_bit(self, world: World) -> None:
        """A braking bound vehicle and traffic that reacts, twice in one process."""
        runs = []
        for _ in range(2):
            world.start()
            snapshot = world.step(nobody())
            world.bind(self.ego, CouplingKind.FREE)
            trace = []
            for step in range(60):
                snapshot = world.step(ahead(snapshot, self.ego, max(5.0 - 0.1 * step, 0.0), self.step_s))
                trace.append(np.column_stack([snapshot.front_x_m, snapshot.front_y_m, snapshot.speed_mps]))
            world.close()
            runs.append(np.concatenate(trace))
        np.testing.assert_array_equal(runs[0], runs[1])
