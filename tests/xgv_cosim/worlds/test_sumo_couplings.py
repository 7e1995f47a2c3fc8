"""Who writes which axis of a bound SUMO vehicle: free, in lane, with the world's driver, and the changes."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pytest

from tests.contracts.world_contract import nobody, place
from tests.xgv_cosim.worlds.sumo_traffic import car
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.worlds.sumo.bindings import TELLING_STEPS
from xgv_cosim.worlds.sumo.couplings import EASING_RATE_MPS
from xgv_cosim.worlds.sumo.libraries import load_libsumo

if TYPE_CHECKING:
    from types import ModuleType

    from tests.xgv_cosim.worlds.conftest import NewWorld
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.worlds.sumo.world import SumoWorld

COMPUTER, DRIVER_STEERS, DRIVER_DRIVES, WORLD = (True, True), (True, False), (False, True), (False, False)
STEP_S = 0.1


class State(NamedTuple):
    position_m: float
    lateral_m: float
    speed_mps: float
    lane_id: str


class Ego:
    """A bound car that is driven along its lane by a plant that knows nothing of SUMO."""

    def __init__(self, world: SumoWorld, kind: CouplingKind) -> None:
        self.world = world
        world.start()
        self.snapshot: Snapshot = world.step(nobody())
        world.bind("ego", kind)
        self.libsumo: ModuleType = load_libsumo()

    @property
    def state(self) -> State:
        row = self.snapshot.index_of["ego"]
        lateral_m = self.libsumo.vehicle.getLateralLanePosition("ego")
        lane_id = (*self.world.road.lane_ids, "off")[self.snapshot.lane[row]]
        return State(
            float(self.snapshot.lane_position_m[row]), lateral_m, float(self.snapshot.speed_mps[row]), lane_id
        )

    def drive(
        self,
        speed_mps: float,
        computer: tuple[bool, bool] = COMPUTER,
        *,
        lateral_m: float = 0.0,
        yaw_rad: float = 0.0,
        travelled_m: float | None = None,
    ) -> State:
        """Advance one step along the lane, ``lateral_m`` left of its centre."""
        way_m = speed_mps * STEP_S if travelled_m is None else travelled_m
        row = np.array([self.snapshot.index_of["ego"]])
        at = self.world.road.points_ahead(
            self.snapshot.lane[row], self.snapshot.lane_position_m[row] + way_m, self.snapshot.next_lane[row]
        )
        heading = float(at.heading_rad[0])
        self.snapshot = self.world.step(
            place(
                "ego",
                float(at.x_m[0] - np.sin(heading) * lateral_m),
                float(at.y_m[0] + np.cos(heading) * lateral_m),
                heading + yaw_rad,
                speed_mps=speed_mps,
                travelled_m=way_m,
                computer=computer,
            )
        )
        return self.state

    @property
    def front(self) -> tuple[float, float]:
        row = self.snapshot.index_of["ego"]
        return float(self.snapshot.front_x_m[row]), float(self.snapshot.front_y_m[row])


EGO = car("ego", 200, 10, kind="xgv")


def test_lane_coupling_moves_exactly_by_the_distance_and_offset_asked(sumo: NewWorld) -> None:
    """Above the limit of 13.89 m/s, and harder than the type can brake: nothing is softened."""
    ego = Ego(sumo(EGO), CouplingKind.LANE)
    for speed_mps, lateral_m in [
        (10.0, 0.0),
        (30.0, 0.3),
        (30.0, -0.6),
        (14.0, -0.6),
        (0.0, 0.2),
        (0.0, 0.2),
        (5.0, 0),
    ]:
        before = ego.state
        after = ego.drive(speed_mps, lateral_m=lateral_m)
        assert after.position_m - before.position_m == pytest.approx(speed_mps * STEP_S, abs=1e-9)
        assert after.speed_mps == pytest.approx(speed_mps, abs=1e-9)
        assert after.lateral_m == pytest.approx(lateral_m, abs=1e-9)


@pytest.mark.parametrize("kind", [CouplingKind.LANE, CouplingKind.AUTO])
def test_sumo_is_told_the_lateral_position_when_it_has_changed(
    sumo: NewWorld, kind: CouplingKind, monkeypatch: pytest.MonkeyPatch
) -> None:
    ego = Ego(sumo(EGO), kind)
    own, told = ego.libsumo.vehicle.setLateralLanePosition, []
    monkeypatch.setattr(
        ego.libsumo.vehicle, "setLateralLanePosition", lambda *given: told.append(given) or own(*given)
    )
    for _ in range(40):
        ego.drive(10.0, lateral_m=0.2)
    assert 40 / TELLING_STEPS - 1 <= len(told) <= 40 / TELLING_STEPS + 1
    assert [offset_m for _, offset_m in told] == pytest.approx([0.2] * len(told))
    for lateral_m in (0.2, 0.2001, 0.2001, 0.2):
        assert ego.drive(10.0, lateral_m=lateral_m).lateral_m == pytest.approx(lateral_m, abs=1e-9)
    ego.drive(10.0, WORLD)
    ego.drive(10.0, lateral_m=0.2)  # in between it was eased to the centre
    for _ in range(8):
        assert ego.drive(10.0, lateral_m=0.2).lateral_m == pytest.approx(0.2, abs=1e-9)


@pytest.mark.parametrize("kind", [CouplingKind.LANE, CouplingKind.AUTO])
def test_what_a_script_says_of_the_lateral_position_is_put_right(sumo: NewWorld, kind: CouplingKind) -> None:
    ego = Ego(sumo(EGO), kind)
    for _ in range(12):
        ego.drive(10.0, lateral_m=0.3)
    ego.libsumo.vehicle.setLateralLanePosition("ego", -0.5)
    laterals = [ego.drive(10.0, lateral_m=0.3).lateral_m for _ in range(TELLING_STEPS)]
    assert laterals[-1] == pytest.approx(0.3, abs=1e-9)


@pytest.mark.parametrize("kind", [CouplingKind.LANE, CouplingKind.AUTO])
def test_bound_again_and_on_the_next_edge_sumo_knows_the_lateral_position(
    sumo: NewWorld, kind: CouplingKind
) -> None:
    ego = Ego(sumo(car("ego", 120, 10, route="A1B1 B1C1", kind="xgv"), net="urban_grid"), kind)
    lanes = set()
    for step in range(90):
        if step == 30:
            ego.world.release("ego")
            ego.world.bind("ego", kind)
        state = ego.drive(10.0, lateral_m=0.25)
        lanes.add(state.lane_id)
        assert state.lateral_m == pytest.approx(0.25, abs=1e-6)
    assert len(lanes) > 1


@pytest.mark.parametrize("kind", [CouplingKind.LANE, CouplingKind.AUTO])
def test_sumo_is_told_the_lateral_position_again_after_a_car_was_kept_from_waiting(
    sumo: NewWorld, kind: CouplingKind
) -> None:
    """SUMO's clock of waiting is stopped by a move, which has its own idea of the offset."""
    ego = Ego(sumo(EGO, options=("--time-to-teleport", "3")), kind)
    laterals = [ego.drive(0.0, lateral_m=0.4).lateral_m for _ in range(60)]
    assert laterals[8:] == pytest.approx([0.4] * 52, abs=1e-6)


@pytest.mark.parametrize("computer", [COMPUTER, DRIVER_STEERS])
@pytest.mark.parametrize("kind", list(CouplingKind))
def test_every_coupling_reports_the_speed_at_the_end_of_the_step(
    sumo: NewWorld, kind: CouplingKind, computer: tuple[bool, bool]
) -> None:
    """To us and to SUMO's own drivers, harder than the type can brake; it moves by the mean all the same."""
    ego = Ego(sumo(EGO), kind)
    for _ in range(10):
        ego.drive(12.0, computer)  # until auto has settled
    for speed_mps in (11.0, 9.0, 7.2, 7.3, 0.0, 0.0, 1.0):
        before = ego.state
        mean_mps = 0.5 * (before.speed_mps + speed_mps)
        after = ego.drive(speed_mps, computer, travelled_m=mean_mps * STEP_S)
        assert after.speed_mps == speed_mps
        assert ego.libsumo.vehicle.getSpeed("ego") == pytest.approx(speed_mps, abs=1e-9)
        assert after.position_m - before.position_m == pytest.approx(mean_mps * STEP_S, abs=1e-6)
        accel_mps2 = ego.snapshot.accel_mps2[ego.snapshot.index_of["ego"]]
        if kind is not CouplingKind.FREE or computer != COMPUTER:
            assert accel_mps2 == pytest.approx((speed_mps - before.speed_mps) / STEP_S, abs=1e-6)


def test_lane_coupling_follows_the_lane_over_a_junction(sumo: NewWorld) -> None:
    ego = Ego(
        sumo(car("ego", 1270, 20, lane=1, route="e0 e1", kind="xgv"), net="freeway_estop"), CouplingKind.LANE
    )
    lanes = [ego.drive(20.0, lateral_m=0.4).lane_id for _ in range(20)]
    assert lanes[0] == "e0_1"
    assert lanes[-1] == "e1_1"
    assert ego.state.lateral_m == pytest.approx(0.4, abs=0.01)


def test_lane_coupling_gives_way_while_the_body_is_outside_the_lane_and_says_so(sumo: NewWorld) -> None:
    ego = Ego(sumo(EGO), CouplingKind.LANE)
    said = {}
    for step, lateral_m in enumerate([0.0, 1.5, 1.5, 1.8, 2.4]):
        ego.drive(10.0, lateral_m=lateral_m)
        said[step] = ego.snapshot.notes
    assert said[2] == ()
    assert said[3] == (("ego", "placed freely: body centre outside the lane"),)
    # From here on it is nearer to the left lane, which it belongs to now.
    assert ego.state.lane_id == "road_1"
    ego.drive(10.0)
    assert ego.snapshot.notes == (("ego", "back in its lane"),)


def test_in_reverse_the_lane_coupling_gives_way(sumo: NewWorld) -> None:
    ego = Ego(sumo(EGO), CouplingKind.LANE)
    ego.drive(0.0)
    before = ego.state
    after = ego.drive(-2.0)
    assert after.position_m - before.position_m == pytest.approx(-0.2, abs=1e-6)
    assert after.speed_mps == -2.0
    assert ego.snapshot.notes == (("ego", "placed freely: reversing, which SUMO's lanes do not know"),)


def test_off_the_road_nobody_but_the_plant_moves_it(sumo: NewWorld) -> None:
    ego = Ego(sumo(EGO), CouplingKind.FREE)
    row = ego.snapshot.index_of["ego"]
    x_m, y_m = float(ego.snapshot.front_x_m[row]), float(ego.snapshot.front_y_m[row])
    for computer in (COMPUTER, WORLD, WORLD):
        ego.snapshot = ego.world.step(
            place("ego", x_m, y_m - 20.0, 0.0, speed_mps=1.0, travelled_m=0.0, computer=computer)
        )
        assert ego.front == pytest.approx((x_m, y_m - 20.0), abs=1e-9)
        assert ego.state.lane_id == "off"
    assert ego.snapshot.notes == ()
    ego.snapshot = ego.world.step(place("ego", x_m, y_m, 0.0, speed_mps=1.0, travelled_m=0.0))
    assert ego.state.lane_id == "road_0"


def test_computer_brakes_and_driver_steers(sumo: NewWorld) -> None:
    """E-stop disable (XGV-31) with a rider: full brake as asked, SUMO eases it to the lane's centre."""
    ego = Ego(sumo(EGO), CouplingKind.FREE)
    ego.drive(10.0, lateral_m=0.45)
    speed_mps, laterals = 10.0, [ego.state.lateral_m]
    while speed_mps > 0.0:
        speed_mps = max(speed_mps - 0.8, 0.0)
        before = ego.state
        # The plant's own idea of the lateral position plays no part now.
        after = ego.drive(speed_mps, DRIVER_STEERS, lateral_m=-3.0)
        assert after.position_m - before.position_m == pytest.approx(speed_mps * STEP_S, abs=1e-9)
        laterals.append(after.lateral_m)
    assert laterals[0] == pytest.approx(0.45, abs=1e-6)
    steps = -np.diff(laterals)
    assert steps.max() <= EASING_RATE_MPS * STEP_S + 1e-9
    assert (steps[:8] > 0.0).all()
    assert laterals[-1] == 0.0
    assert ego.state.lane_id == "road_0"


def test_computer_steers_and_driver_governs_speed(sumo: NewWorld) -> None:
    """Partial mode manual speed (XGV-39): SUMO follows the car ahead, the plant has the lateral position."""
    ego = Ego(
        sumo(car("front", 260, 6, extra='<stop lane="road_0" endPos="380" duration="99"/>'), EGO),
        CouplingKind.FREE,
    )
    ego.drive(10.0)
    for step in range(250):
        state = ego.drive(10.0, DRIVER_DRIVES, lateral_m=0.3 if step > 20 else 0.0)
        assert ego.snapshot.collisions == ()
    assert state.lateral_m == pytest.approx(0.3, abs=1e-6)
    assert state.speed_mps == pytest.approx(0.0, abs=0.1)
    assert 1.5 < ego.snapshot.leader_gap_m[ego.snapshot.index_of["ego"]] < 4.0


def test_hand_over_to_the_worlds_driver_and_back_is_bumpless(sumo: NewWorld) -> None:
    """Neither position nor speed jumps: along the lane, sideways, there and back again."""
    ego = Ego(sumo(EGO), CouplingKind.FREE)
    for _ in range(5):
        ego.drive(10.0, lateral_m=-0.5)
    states, fronts = [ego.state], [ego.front]
    for _ in range(20):
        # What the plant says is of no account while the driver has both axes.
        states.append(ego.drive(25.0, WORLD, lateral_m=2.0))
        fronts.append(ego.front)
    last = states[-1].speed_mps
    for _ in range(5):
        states.append(ego.drive(last))
        fronts.append(ego.front)
    speeds = np.array([state.speed_mps for state in states])
    along = np.diff([state.position_m for state in states])
    sideways = np.diff([state.lateral_m for state in states])
    assert np.abs(np.diff(speeds)).max() <= 0.26 + 1e-9  # the type accelerates at 2.6 m/s²
    assert last > 10.0
    np.testing.assert_allclose(along, speeds[1:] * STEP_S, atol=1e-6)
    assert np.abs(sideways).max() <= EASING_RATE_MPS * STEP_S + 1e-9
    assert states[20].lateral_m == 0.0
    np.testing.assert_allclose(np.hypot(*np.diff(fronts, axis=0).T), along, atol=2e-3)


def test_a_released_car_is_eased_to_the_centre_too(sumo: NewWorld) -> None:
    ego = Ego(sumo(EGO), CouplingKind.FREE)
    ego.drive(10.0, lateral_m=0.5)
    ego.world.release("ego")
    laterals = []
    for _ in range(12):
        ego.snapshot = ego.world.step(nobody())
        laterals.append(ego.state.lateral_m)
    assert laterals[0] == pytest.approx(0.45, abs=1e-6)
    assert laterals[-1] == 0.0


def test_modes_are_switched_on_changes_only_and_the_type_is_untouched(sumo: NewWorld) -> None:
    ego = Ego(sumo(EGO), CouplingKind.FREE)
    vehicle = ego.libsumo.vehicle
    before = [vehicle.getDecel("ego"), vehicle.getApparentDecel("ego"), vehicle.getTau("ego")]
    seen = []
    for computer in (WORLD, COMPUTER, DRIVER_STEERS, DRIVER_DRIVES, WORLD):
        ego.drive(10.0, computer)
        seen.append((vehicle.getSpeedMode("ego"), vehicle.getLaneChangeMode("ego")))
    assert seen == [(31, 1621), (0, 0), (0, 0), (31, 0), (31, 1621)]
    vehicle.setLaneChangeMode("ego", 512)
    ego.drive(10.0, WORLD)
    assert vehicle.getLaneChangeMode("ego") == 512  # nobody wrote it again
    assert [vehicle.getDecel("ego"), vehicle.getApparentDecel("ego"), vehicle.getTau("ego")] == before


def test_the_coupling_can_be_changed_under_way(sumo: NewWorld) -> None:
    ego = Ego(sumo(EGO), CouplingKind.FREE)
    for kind in (CouplingKind.LANE, CouplingKind.FREE, CouplingKind.LANE):
        ego.world.set_coupling("ego", kind)
        for _ in range(3):
            before = ego.state
            after = ego.drive(10.0, lateral_m=0.2)
            assert after.position_m - before.position_m == pytest.approx(1.0, abs=1e-3)
            assert after.lateral_m == pytest.approx(0.2, abs=1e-6)


def test_a_driver_whose_car_stood_under_the_computer_drives_on(sumo: NewWorld) -> None:
    """After a pause the rider takes over: no left-over speed of 0 holds him."""
    ego = Ego(sumo(EGO), CouplingKind.FREE)
    for _ in range(10):
        ego.drive(0.0)
    for _ in range(30):
        ego.drive(0.0, WORLD)
    assert ego.state.speed_mps == pytest.approx(6.0, abs=0.3)  # 1 s at 1 m/s², then 2.6 m/s²


def test_giving_way_ends_silently_where_the_free_coupling_is_asked_for(sumo: NewWorld) -> None:
    ego = Ego(sumo(EGO), CouplingKind.LANE)
    ego.drive(10.0, lateral_m=1.8)
    assert ego.snapshot.notes
    ego.world.set_coupling("ego", CouplingKind.FREE)
    ego.drive(10.0)
    ego.world.set_coupling("ego", CouplingKind.LANE)
    ego.drive(10.0)
    assert ego.snapshot.notes == ()
