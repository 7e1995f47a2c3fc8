"""The reference stack on made-up views: session first, then lane and distance."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus, StatusCommand
from xgv_cosim.actuation import Gear
from xgv_cosim.autonomy.longitudinal import wanted_accel_mps2
from xgv_cosim.autonomy.reference import ReferenceStack, ReferenceStackSettings
from xgv_cosim.commands import DiscreteDevices, MotionProfile
from xgv_cosim.endpoint import CommandStatus, ReleaseControl, RequestControl
from xgv_cosim.observation import DeviceReading, Observation

PD, MPD = ComponentId.PRIMITIVE_DRIVER, ComponentId.MOTION_PROFILE_DRIVER
ME = JausAddress(1, 2, 2, 1)
CAR = JausAddress(9, 1, 10, 1)


def seen(
    speed: float = 20.0,
    gap: float = math.inf,
    leader_speed: float = 20.0,
    lane: tuple[tuple[float, float], ...] = tuple((3.5 + 5.0 * n, 0.0) for n in range(10)),
) -> Observation:
    return Observation(
        time_s=0.0,
        vehicle_id="xgv_0",
        x_m=0.0,
        y_m=0.0,
        heading_rad=0.0,
        speed_mps=speed,
        accel_mps2=0.0,
        curvature_per_m=0.0,
        limit_mps=30.0,
        lane_ahead_m=lane,
        leader_gap_m=gap,
        leader_speed_mps=leader_speed,
        safety_mode="drive_by_wire",
        reasons=(),
        component_status={PD: ComponentStatus.READY, MPD: ComponentStatus.READY},
        component_controller={PD: CAR, MPD: ME},
        devices=DeviceReading(gear=Gear.DRIVE, gear_wanted=Gear.DRIVE, engine_on=True, parking_brake=False),
    )


def wanted(view: Observation, settings: ReferenceStackSettings | None = None) -> float:
    return wanted_accel_mps2(view, settings or ReferenceStackSettings(), math.inf)


def motion_of(stack: ReferenceStack, view: Observation) -> MotionProfile:
    motion = stack.act(view)[-1]
    assert isinstance(motion, MotionProfile)
    return motion


def test_without_control_it_asks_as_the_public_clients_do() -> None:
    """XGV-17..20: release PD if held, request MPD, resume what stands by."""
    view = replace(
        seen(),
        component_controller={PD: ME, MPD: None},
        component_status={PD: ComponentStatus.STANDBY, MPD: ComponentStatus.STANDBY},
    )
    *session, motion = ReferenceStack(ME).act(view)
    assert session == [
        ReleaseControl(PD),
        RequestControl(MPD, 6),
        CommandStatus(PD, StatusCommand.RESUME),
        CommandStatus(MPD, StatusCommand.RESUME),
    ]
    assert isinstance(motion, MotionProfile)
    assert len(ReferenceStack(ME).act(seen())) == 1  # in control and ready: only the motion


@pytest.mark.parametrize(
    ("mode", "starts", "releases"),
    [
        ("drive_by_wire", True, True),
        ("software_pause", True, False),
        ("estop_pause", True, False),
        ("manual_override", False, False),
        ("emergency_manual_override", False, False),
        ("estop_disable", False, False),
        ("inactive", False, False),
    ],
)
def test_it_starts_the_engine_and_releases_the_parking_brake_where_it_may_xgv_34(
    mode: str, starts: bool, releases: bool
) -> None:
    """XGV-16, XGV-34: never where the human has all systems, nor a car that another controls."""
    stands = DeviceReading(gear=Gear.DRIVE, gear_wanted=Gear.DRIVE, engine_on=False, parking_brake=True)
    view = replace(seen(), safety_mode=mode, devices=stands)
    said = [message for message in ReferenceStack(ME).act(view) if isinstance(message, DiscreteDevices)]
    expected = DiscreteDevices(engine_on=starts or None, parking_brake=False if releases else None)
    assert said == ([] if expected == DiscreteDevices() else [expected])
    of_another = replace(view, component_controller={PD: CAR, MPD: CAR})
    assert not any(isinstance(message, DiscreteDevices) for message in ReferenceStack(ME).act(of_another))


def test_a_free_road_leads_to_the_limit_and_a_wish_below_it_is_kept() -> None:
    assert motion_of(ReferenceStack(ME), seen(speed=10.0)).speed_mps > 10.0
    assert wanted(seen(speed=30.0)) == pytest.approx(0.0)
    slow = ReferenceStackSettings(desired_speed_mps=15.0)
    assert wanted(seen(speed=15.0), slow) == pytest.approx(0.0)
    assert wanted(seen(speed=20.0), slow) < -1.0


@given(speed=st.floats(0.0, 35.0), gap=st.floats(0.2, 150.0), leader=st.floats(0.0, 35.0))
def test_it_never_speeds_up_into_a_short_gap_and_never_asks_for_nonsense(
    speed: float, gap: float, leader: float
) -> None:
    stack = ReferenceStack(ME)
    motion = motion_of(stack, seen(speed=speed, gap=gap, leader_speed=leader))
    assert 0.0 <= motion.speed_mps <= 30.0
    assert 0.0 < motion.max_accel_mps2 <= 7.5
    if gap < 3.0:
        assert wanted(seen(speed=speed, gap=gap, leader_speed=leader)) <= 0.0


@pytest.mark.parametrize("curvature", [-0.02, -0.002, 0.002, 0.02])
def test_on_an_arc_it_asks_for_the_arc(curvature: float) -> None:
    """Pure pursuit of a point on the car's own arc gives that arc's curvature."""
    radius = 1.0 / curvature
    arc = tuple(
        (radius * math.sin(s * curvature), radius * (1.0 - math.cos(s * curvature))) for s in range(1, 60, 3)
    )
    motion = motion_of(ReferenceStack(ME), seen(speed=12.0, lane=arc))
    assert motion.curvature_per_m == pytest.approx(curvature, rel=0.02)


def test_off_the_road_it_goes_straight() -> None:
    assert motion_of(ReferenceStack(ME), seen(lane=())).curvature_per_m == 0.0


def test_off_the_road_it_stops() -> None:
    motion = motion_of(ReferenceStack(ME), seen(speed=15.0, lane=()))
    assert motion.speed_mps < 15.0
    assert motion.max_accel_mps2 == 3.0
