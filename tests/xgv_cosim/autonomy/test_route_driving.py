"""What the reference stacks decide on made-up views: lane changes, yellow, right of way, curves."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from jaus.address import ComponentId
from tests.xgv_cosim.autonomy.test_reference_stack import CAR, ME, seen
from xgv_cosim.autonomy.crossing import Crossings
from xgv_cosim.autonomy.driving import RouteDriving, lane_end_stop_m
from xgv_cosim.autonomy.lateral import LaneChanges, gap_allows
from xgv_cosim.autonomy.longitudinal import curve_speeds, slowing_mps2
from xgv_cosim.autonomy.settings import ReferenceStackSettings
from xgv_cosim.autonomy.wrench import ReferenceWrenchStack, pedal_shares, steering_share
from xgv_cosim.commands import WrenchEffort
from xgv_cosim.endpoint import ReleaseControl, RequestControl
from xgv_cosim.observation import LaneBeside, Observation
from xgv_cosim.parameters import VehicleParameters
from xgv_cosim.perception import way_curvature
from xgv_cosim.surroundings import PREVIEW_M, Foe, Junction, Signal

SETTINGS = ReferenceStackSettings()
EMPTY = LaneBeside(3.2, math.inf, 0.0, math.inf, 0.0)
PD, MPD = ComponentId.PRIMITIVE_DRIVER, ComponentId.MOTION_PROFILE_DRIVER


def test_at_yellow_it_stops_where_3_mps2_are_enough_and_at_red_wherever_it_can() -> None:
    """15 m/s: 3 m/s² need 37.5 m, 7.5 m/s² need 15 m."""
    crossings = Crossings(SETTINGS)

    def stop_m(line_m: float, letter: str) -> float:
        return crossings.stop_m(replace(seen(speed=15.0), signal=Signal(line_m, letter)))

    assert stop_m(38.0, "y") == pytest.approx(37.0)
    assert stop_m(37.0, "y") == math.inf
    assert stop_m(16.0, "r") == pytest.approx(15.0)
    assert stop_m(14.0, "r") == math.inf
    assert stop_m(50.0, "G") == math.inf
    assert stop_m(50.0, "u") == pytest.approx(49.0)


def foe(entry_m: float, speed: float = 10.0, *, first: bool = True) -> Foe:
    return Foe("f", 22.0, 26.0, entry_m, entry_m + 4.0, speed, 5.0, first, not first)


@pytest.mark.parametrize(
    ("right_of_way", "other", "waits"),
    [
        ("minor", foe(30.0), True),  # both there after some 2 s
        ("minor", foe(300.0), False),  # it is through long before
        ("minor", foe(30.0, first=False), False),  # the other one yields
        ("major", foe(30.0, first=False), False),
        ("major", foe(30.0), True),  # inside already: he leaves first, whatever the own signal
        ("equal", foe(30.0), True),
        ("minor", foe(-2.0, 0.0), True),  # stands where the ways meet
    ],
)
def test_it_waits_for_those_first_who_come_at_the_same_time(
    right_of_way: str, other: Foe, waits: bool
) -> None:
    view = replace(seen(speed=10.0), junction=Junction(20.0, 30.0, right_of_way, (other,)))
    assert (Crossings(SETTINGS).stop_m(view) < math.inf) is waits


def test_at_a_stop_line_it_stands_first() -> None:
    crossings, junction = Crossings(SETTINGS), Junction(2.0, 12.0, "stop")
    assert crossings.stop_m(replace(seen(speed=3.0), junction=junction)) == pytest.approx(1.0)
    assert crossings.stop_m(replace(seen(speed=0.0), junction=junction)) == math.inf


def test_it_does_not_block_a_crossing_behind_a_queue() -> None:
    view = replace(seen(speed=5.0, gap=33.0, leader_speed=0.0), junction=Junction(20.0, 30.0, "minor"))
    assert Crossings(SETTINGS).stop_m(view) == pytest.approx(19.0)
    assert Crossings(SETTINGS).stop_m(replace(view, leader_gap_m=40.0)) == math.inf


def test_a_lane_change_is_begun_in_a_gap_and_ends_when_the_lane_is_the_next() -> None:
    changes = LaneChanges()
    view = replace(seen(), lane_id="e_0", lane_changes=1, lane_end_m=300.0, left=EMPTY)
    assert changes.decide(replace(view, left=replace(EMPTY, follower_gap_m=1.0))) is None
    assert changes.decide(view) == EMPTY
    assert changes.side == 1
    over = replace(view, lane_id="e_1", lane_changes=0, lateral_m=-1.6)
    assert changes.decide(over) is None
    assert changes.side == 0


def test_in_a_hurry_shorter_gaps_do_but_none_that_forces_an_emergency() -> None:
    view = seen(speed=20.0)
    close = LaneBeside(3.2, 20.0, 20.0, 12.0, 20.0)
    assert not gap_allows(view, close, 0.0)
    assert gap_allows(view, close, 1.0)
    assert not gap_allows(view, replace(close, follower_speed_mps=30.0), 1.0)
    assert not gap_allows(view, replace(close, leader_gap_m=-1.0), 1.0)


def test_it_waits_with_room_left_before_its_lane_ends() -> None:
    view = replace(seen(), lane_changes=-2, lane_end_m=100.0)
    assert lane_end_stop_m(view, changes=False) == pytest.approx(100.0 - 3.0 - 24.0)
    assert lane_end_stop_m(replace(view, lane_changes=0), changes=False) == math.inf


def test_the_line_to_follow_moves_over_during_a_change() -> None:
    driving = RouteDriving(SETTINGS)
    view = replace(seen(), lane_id="e_0", lane_changes=1, lane_end_m=300.0, left=EMPTY)
    assert driving.wish(view).curvature_per_m > 0.001
    assert RouteDriving(SETTINGS).wish(seen()).curvature_per_m == pytest.approx(0.0)


def test_curves_ask_for_their_speed_in_time() -> None:
    """2 m/s² on a radius of 50 m: 10 m/s; even braking from 15 m/s at 1.4 m/s² begins 45 m before."""
    view = replace(seen(speed=15.0), curvature_ahead=((0.0, 0.0), (60.0, 0.02), (80.0, 0.02)))
    assert (60.0, pytest.approx(10.0)) in curve_speeds(view, SETTINGS)
    assert slowing_mps2(15.0, 60.0, 10.0) > 0.0
    assert slowing_mps2(15.0, 40.0, 10.0) < -1.0
    assert slowing_mps2(10.0, 0.0, 10.0) == pytest.approx(0.0)


@pytest.mark.parametrize("radius_m", [10.0, 40.0, 200.0])
def test_the_curvature_of_an_arc_is_found_and_a_slight_kink_is_smoothed(radius_m: float) -> None:
    angle = PREVIEW_M / radius_m
    x, y = radius_m * np.sin(angle), radius_m * (1.0 - np.cos(angle))
    assert way_curvature(x[None], y[None])[0, 4:10] == pytest.approx(1.0 / radius_m, rel=0.15)
    kink = np.where(PREVIEW_M > 48.0, (PREVIEW_M - 48.0) * math.tan(math.radians(2.0)), 0.0)
    assert np.abs(way_curvature(PREVIEW_M[None], kink[None])).max() < 0.003


def takes_over(*views: Observation) -> bool:
    """Return whether it takes over at the last of these views."""
    driving = RouteDriving(SETTINGS)
    wishes = [driving.wish(view) for view in views]
    return driving.may_take_over(views[-1], wishes[-1])


def test_it_takes_over_where_it_can_go_on_only() -> None:
    turning = replace(seen(speed=10.0), curvature_per_m=0.15)
    assert not takes_over(turning)
    assert takes_over(seen(speed=10.0))
    assert takes_over(replace(turning, speed_mps=0.5))


@pytest.mark.parametrize("to_left", [-1.0, 1.0])
def test_it_lets_another_driver_end_his_lane_change(to_left: float) -> None:
    """While the car moves across its lane, far from its centre; one that drives on beside it may go on."""

    def at(time_s: float, left_m: float, speed_mps: float = 10.0, lane: str = "e_0") -> Observation:
        aside = replace(seen(speed=speed_mps), time_s=time_s, lateral_m=to_left * left_m, lane_id=lane)
        return replace(aside, lane_changes=0)

    assert not takes_over(at(0.0, 1.3), at(0.1, 1.4))
    assert not takes_over(at(0.0, 1.5), at(0.1, -1.6, lane="e_1"))
    assert not takes_over(at(0.0, -0.82), at(0.1, -0.71))
    assert takes_over(at(0.0, -0.80), at(0.1, -0.69))
    assert takes_over(at(0.0, 1.0), at(0.1, 1.0))
    assert takes_over(at(0.0, 1.0))
    assert takes_over(at(0.0, 1.3), at(0.1, 1.4, 0.5))


def test_wrench_efforts_follow_the_relation_of_public_clients_xgv_62() -> None:
    """XGV-62: ``curvature = tan(phi / (1 + v² k)) / L``; the pedals give what the car's forces are."""
    parameters = VehicleParameters()
    share = steering_share(0.02, 15.0, parameters)
    phi = share * parameters.max_steer_rad
    stretch = 1.0 + 225.0 * parameters.understeer_rad_s2_per_m / parameters.wheelbase_m
    assert math.tan(phi / stretch) / parameters.wheelbase_m == pytest.approx(0.02)
    assert pedal_shares(-4.2, 10.0, parameters) == (0.0, pytest.approx(0.5))
    throttle, brake = pedal_shares(6200.0 / 1900.0, 5.0, parameters)
    assert (throttle, brake) == (pytest.approx(1.0), 0.0)


def test_the_wrench_stack_asks_for_the_primitive_driver_alone_xgv_18() -> None:
    stack = ReferenceWrenchStack(ME, VehicleParameters())
    *session, effort = stack.act(seen())
    assert session == [ReleaseControl(MPD), RequestControl(PD, 6)]
    assert isinstance(effort, WrenchEffort)
    held = replace(seen(), component_controller={PD: ME, MPD: None})
    assert len(stack.act(held)) == 1
    assert replace(held, component_controller={PD: CAR, MPD: None}).component_controller[PD] == CAR
