"""Bodies in two lanes: SUMO's drivers see them in both, and nobody else sees more than one vehicle."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from tests.contracts.world_contract import SNAPSHOT_LISTS, nobody, place
from tests.xgv_cosim.worlds.sumo_traffic import car, network, write_config
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo.ghosts import GHOST_PREFIX
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from xgv_cosim.snapshot import Snapshot

STEP_S = 0.1
WIDTH_M = 3.2
Open = "Callable[..., Car]"


class Car:
    """The bound car ``ego`` on the straight road of ``hello``, driven along lane ``road_0``."""

    def __init__(self, world: SumoWorld, kind: CouplingKind) -> None:
        self.world = world
        world.start()
        self.vehicle: Any = load_libsumo().vehicle
        self.snapshot: Snapshot = world.step(nobody())
        self.position_m = self.of("ego", "lane_position_m")
        world.bind("ego", kind)

    def of(self, name: str, column: str) -> float:
        return float(getattr(self.snapshot, column)[self.snapshot.index_of[name]])

    def lane_of(self, name: str) -> str:
        return self.world.road.lane_ids[int(self.of(name, "lane"))]

    def drive(self, lateral_m: float, speed_mps: float = 0.0, yaw_rad: float = 0.0) -> Snapshot:
        """One step, the front ``lateral_m`` left of the centre of the right lane."""
        self.position_m += speed_mps * STEP_S
        lane = np.array([self.world.road.index_of["road_0"]])
        at = self.world.road.points_ahead(lane, np.array([self.position_m]), np.array([-1]))
        heading = float(at.heading_rad[0])
        self.snapshot = self.world.step(
            place(
                "ego",
                float(at.x_m[0] - np.sin(heading) * lateral_m),
                float(at.y_m[0] + np.cos(heading) * lateral_m),
                heading + yaw_rad,
                speed_mps=speed_mps,
                travelled_m=speed_mps * STEP_S,
            )
        )
        return self.snapshot

    @property
    def ghosts(self) -> list[tuple[str, float]]:
        """Lane of each ghost, and how far its front is ahead of the car's, from SUMO itself."""
        found = [name for name in self.vehicle.getIDList() if name.startswith(GHOST_PREFIX)]
        heading = self.of("ego", "heading_rad")
        here = self.of("ego", "front_x_m"), self.of("ego", "front_y_m")
        places = [self.vehicle.getPosition(name) for name in found]
        ahead_m = [np.dot(np.subtract(at, here), (np.cos(heading), np.sin(heading))) for at in places]
        return sorted(zip(map(self.vehicle.getLaneID, found), map(float, ahead_m), strict=True))


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Callable[..., Car]]:
    worlds: list[SumoWorld] = []

    def new(
        *vehicles: str, kind: CouplingKind = CouplingKind.FREE, with_ghosts: bool = True, **more: Any
    ) -> Car:
        config = write_config(tmp_path, "".join(vehicles), network("hello"))
        worlds.append(SumoWorld.headless(config, step_s=STEP_S, seed=1, with_ghosts=with_ghosts, **more))
        return Car(worlds[-1], kind)

    yield new
    for world in worlds:
        world.close()


EGO = car("ego", 400, 0, kind="xgv")
FOLLOWERS = (car("right", 300, 12), car("left", 300, 12, lane=1))


@pytest.mark.parametrize("kind", list(CouplingKind))
@pytest.mark.parametrize("lateral_m", [1.2, 2.0])
def test_followers_in_both_lanes_stop_behind_a_car_across_the_line(
    opened: Callable[..., Car], kind: CouplingKind, lateral_m: float
) -> None:
    car_ = opened(EGO, *FOLLOWERS, kind=kind)
    for _ in range(250):
        snapshot = car_.drive(lateral_m)
        assert snapshot.collisions == ()
        assert set(snapshot.ids) == {"ego", "left", "right"}
    rear_m = car_.position_m - 4.4
    for name in ("left", "right"):
        assert car_.of(name, "speed_mps") == pytest.approx(0.0, abs=0.05)
        assert 1.0 < rear_m - car_.of(name, "lane_position_m") < 3.0


def test_without_ghosts_the_follower_in_the_other_lane_drives_through(opened: Callable[..., Car]) -> None:
    """What the ghosts are for: SUMO alone neither stops it nor reports anything."""
    car_ = opened(EGO, *FOLLOWERS, with_ghosts=False)
    for _ in range(250):
        car_.drive(1.2)
    assert car_.of("left", "lane_position_m") > car_.position_m + 50.0
    assert car_.of("right", "speed_mps") == pytest.approx(0.0, abs=0.05)


def test_a_ghost_stands_exactly_as_long_as_the_body_reaches_over_the_line(opened: Callable[..., Car]) -> None:
    """The car is 1.8 m wide in a lane of 3.2 m: from 0.7 m on it is over the line."""
    car_ = opened(EGO)
    seen = {}
    for lateral_m in (0.0, 0.74, 0.76, 0.72, 0.69, 1.5, 1.7, 2.4, 2.46, 2.51, 3.2):
        car_.drive(lateral_m, speed_mps=1.0)
        seen[lateral_m] = [lane for lane, _ in car_.ghosts]
        assert all(ahead_m == pytest.approx(0.0, abs=0.05) for _, ahead_m in car_.ghosts)
        assert car_.vehicle.getIDCount() == 1 + len(car_.ghosts)
    other = ["road_1"]
    assert seen == {
        0.0: [], 0.74: [], 0.76: other, 0.72: other, 0.69: [], 1.5: other,
        1.7: ["road_0"], 2.4: ["road_0"], 2.46: ["road_0"], 2.51: [], 3.2: [],
    }  # fmt: skip


def test_a_car_askew_is_seen_where_its_rear_is(opened: Callable[..., Car]) -> None:
    """Front on the right lane's centre, turned to the right: the rear hangs over to the left."""
    car_ = opened(EGO)
    car_.drive(0.0, yaw_rad=-0.4)
    assert [lane for lane, _ in car_.ghosts] == ["road_1"]
    car_.drive(0.0, yaw_rad=-0.1)
    assert car_.ghosts == []


def test_a_car_half_off_the_road_is_seen_on_the_nearest_lane(opened: Callable[..., Car]) -> None:
    """To the right of the right lane is no lane; SUMO has the car nowhere, its rear is still in the lane."""
    car_ = opened(EGO, FOLLOWERS[0])
    car_.drive(-1.0)
    assert car_.ghosts == []
    for _ in range(250):
        snapshot = car_.drive(-2.9, yaw_rad=-0.4)
        assert snapshot.lane[snapshot.index_of["ego"]] == -1
        assert [lane for lane, _ in car_.ghosts] == ["road_0"]
    assert car_.of("right", "speed_mps") == pytest.approx(0.0, abs=0.05)
    assert car_.of("right", "lane_position_m") < car_.position_m - 4.4
    car_.drive(-6.0)
    assert car_.ghosts == []


def test_ghosts_show_nowhere(opened: Callable[..., Car]) -> None:
    """Ids, counts, departures, arrivals, teleports, contacts and neighbours: one vehicle, its owner."""
    car_ = opened(EGO, *FOLLOWERS, car("bound_too", 330, 12, lane=1, kind="xgv"))
    car_.world.bind("bound_too", CouplingKind.FREE)
    car_.world.release("bound_too")
    car_.vehicle.setSpeedMode("left", 0)
    car_.vehicle.setSpeed("left", 12.0)  # drives through the ghost
    for step in range(250):
        snapshot = car_.drive(1.2 if step < 150 else 0.0)
        texts = [*snapshot.ids, *snapshot.departed, *snapshot.arrived, *snapshot.teleported]
        texts += [name for contact in snapshot.collisions for name in (contact.collider, contact.victim)]
        assert not any(text.startswith(GHOST_PREFIX) for text in texts)
        for column in fields(snapshot):
            if column.name not in SNAPSHOT_LISTS:
                assert len(getattr(snapshot, column.name)) == len(snapshot.ids)
        if step == 100:
            assert car_.vehicle.getIDCount() == len(snapshot.ids) + 1


WITHOUT_GHOSTS = ("fcd", "tripinfo", "emission", "vehroute", "battery")
WITH_GHOSTS = ("collision", "netstate", "full", "amitran")


def test_ghosts_show_in_no_file_that_sumo_writes_by_vehicle(
    opened: Callable[..., Car], tmp_path: Path
) -> None:
    """Point 3.2: the devices that write them are switched off; files without devices show ghosts."""
    files = {name: tmp_path / f"{name}.xml" for name in (*WITHOUT_GHOSTS, *WITH_GHOSTS)}
    options = [
        f"--{name}-{'dump' if name == 'netstate' else 'output'}={file}" for name, file in files.items()
    ]
    statistics = tmp_path / "statistics.xml"
    options += [f"--device.{name}.probability=1" for name in ("battery", "ssm", "rerouting", "driverstate")]
    options += [f"--device.ssm.file={tmp_path / 'ssm.xml'}", f"--statistic-output={statistics}"]
    options += ["--tripinfo-output.write-unfinished=true", "--vehroute-output.write-unfinished=true"]
    edges = [tmp_path / "all.xml", tmp_path / "ours.xml"]
    rows = [
        f'<edgeData id="{file.stem}" {vtypes} file="{file}"/>'
        for file, vtypes in zip(edges, ("", 'vTypes="car xgv"'), strict=True)
    ]
    (tmp_path / "t.add.xml").write_text(f"<additional>{''.join(rows)}</additional>")
    options.append(f"--additional-files={tmp_path / 't.add.xml'}")
    car_ = opened(EGO, *FOLLOWERS, options=tuple(options))
    car_.vehicle.setSpeedMode("left", 0)
    car_.vehicle.setSpeed("left", 12.0)  # drives through the ghost, which SUMO writes down as a collision
    for step in range(150):
        car_.drive(1.2 if step < 120 else 0.0)
        assert bool(car_.ghosts) is (step < 120)
    car_.world.close()
    for name in WITHOUT_GHOSTS:
        text = without_options(files[name])
        assert GHOST_PREFIX not in text, name
        assert '"ego"' in text, name
    for name in WITH_GHOSTS:  # docs/limits.md says so
        assert GHOST_PREFIX in without_options(files[name]), name
    ssm = without_options(tmp_path / "ssm.xml")
    assert f'ego="{GHOST_PREFIX}' not in ssm
    assert 'ego="left"' in ssm
    assert '<vehicleTripStatistics count="3"' in without_options(statistics)
    assert '<vehicles loaded="4" inserted="4"' in without_options(statistics)  # nothing keeps it out there
    assert ['departed="3"' in without_options(file) for file in edges] == [False, True]


def without_options(file: Path) -> str:
    """Return what SUMO has written below the comment with its options, which name folders."""
    return file.read_text().partition("-->")[2]


def test_a_bound_follower_has_the_owner_as_its_leader(opened: Callable[..., Car]) -> None:
    car_ = opened(EGO, car("behind", 370, 0, lane=1, kind="xgv"))
    car_.world.bind("behind", CouplingKind.FREE)
    car_.world.release("behind")
    car_.drive(1.2)
    car_.world.bind("behind", CouplingKind.LANE)
    car_.drive(1.2)
    row = car_.snapshot.index_of["behind"]
    assert car_.snapshot.ids[car_.snapshot.leader[row]] == "ego"
    rear_m = car_.position_m - 4.4
    assert car_.snapshot.leader_gap_m[row] == pytest.approx(
        rear_m - car_.of("behind", "lane_position_m"), abs=0.3
    )  # the road bends


@pytest.mark.parametrize("with_ghosts", [True, False])
def test_followers_in_the_target_lane_react_before_the_front_crosses(
    opened: Callable[..., Car], with_ghosts: bool
) -> None:
    """A lane change at 0.8 m/s sideways: the body is over the line 0.9 m, about 1.1 s, before the front."""
    car_ = opened(car("ego", 400, 10, kind="xgv"), car("left", 378, 13, lane=1), with_ghosts=with_ghosts)
    lateral_m, reacted_s = 0.0, np.inf
    for step in range(60):
        lateral_m = min(lateral_m + 0.08, 3.2)
        before = car_.of("left", "speed_mps")
        car_.drive(lateral_m, speed_mps=10.0)
        if car_.of("left", "speed_mps") < before - 0.1:
            reacted_s = min(reacted_s, step * STEP_S)
    over_line_s, front_over_s = 0.7 / 0.8, 1.6 / 0.8
    if with_ghosts:
        assert over_line_s <= reacted_s <= over_line_s + 0.3
    else:
        assert reacted_s >= front_over_s


def test_a_released_owner_has_no_ghost(opened: Callable[..., Car]) -> None:
    car_ = opened(EGO)
    car_.drive(1.2)
    assert len(car_.ghosts) == 1
    car_.world.release("ego")
    car_.snapshot = car_.world.step(nobody())
    assert car_.ghosts == []


LIKE_ITS_OWNER = (
    *("getLength", "getWidth", "getDecel", "getApparentDecel"),
    *("getTau", "getMinGap", "getVehicleClass", "getMaxSpeedLat"),
)


def test_the_ghost_is_like_its_owner_to_those_behind(opened: Callable[..., Car]) -> None:
    """Its followers expect the same braking of it; no random number is drawn for it."""
    car_ = opened(EGO)
    car_.drive(1.2)
    (ghost,) = (name for name in car_.vehicle.getIDList() if name.startswith(GHOST_PREFIX))
    for getter in LIKE_ITS_OWNER:
        assert getattr(car_.vehicle, getter)(ghost) == getattr(car_.vehicle, getter)("ego"), getter
    assert car_.vehicle.getSpeedFactor(ghost) == 1.0


def test_the_ghost_is_like_an_owner_of_whom_a_script_has_set_something(opened: Callable[..., Car]) -> None:
    """SUMO makes such a vehicle a type of its own; the next ghost knows what was set since the last."""
    car_ = opened(EGO)
    car_.vehicle.setTau("ego", 2.0)
    for min_gap_m, tau_s, lateral_m in ((9.0, 3.0, 1.2), (4.0, 1.5, 0.0), (4.0, 1.5, 1.2)):
        car_.vehicle.setMinGap("ego", min_gap_m)
        car_.vehicle.setTau("ego", tau_s)
        car_.drive(lateral_m)
        for ghost in (name for name in car_.vehicle.getIDList() if name.startswith(GHOST_PREFIX)):
            for getter in LIKE_ITS_OWNER:
                assert getattr(car_.vehicle, getter)(ghost) == getattr(car_.vehicle, getter)("ego"), getter


def test_nobody_brakes_for_a_ghost_that_is_as_fast_as_he_is(opened: Open) -> None:
    """SUMO has a vehicle stand in the step in which it comes; that step is over before anybody looks."""
    ego = opened(car("ego", 200, 13), car("behind", 175, 13, lane=1))
    speeds_mps, ghosts = [], 0
    for step in range(40):
        ego.drive(min(0.1 * max(step - 10, 0), 1.2), 13.0)
        speeds_mps.append(ego.of("behind", "speed_mps"))
        ghosts += len(ego.ghosts)
    assert ghosts > 15
    assert np.diff(speeds_mps).min() > -0.05
