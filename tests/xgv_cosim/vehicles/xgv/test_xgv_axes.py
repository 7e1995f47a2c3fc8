"""What each mode of the XGV does to each axis, over every combination, and as columns."""

from __future__ import annotations

import numpy as np
import pytest

from jaus.vehicle_mode import ControlMode, ReadyMode, SafetyMode
from xgv_cosim.actuation import Lateral, Longitudinal
from xgv_cosim.commands import CommandKind
from xgv_cosim.vehicles.base import ModeInputs, Resolution
from xgv_cosim.vehicles.xgv.modes import resolve_lateral
from xgv_cosim.vehicles.xgv.settings import PauseSteering
from xgv_cosim.vehicles.xgv.tables import SOFTWARE_READY_TABLE, resolve

EVERYTHING = np.stack(
    np.meshgrid(range(2048), list(ControlMode), list(ReadyMode), range(4), list(CommandKind), indexing="ij")
).reshape(5, -1)
"""All inputs at once: devices, control mode, ready mode, partial mode, command kind."""

BY_WIRE = {SafetyMode.DRIVE_BY_WIRE, SafetyMode.SOFTWARE_PAUSE, SafetyMode.ESTOP_PAUSE}
LIVE = {
    (ControlMode.MOTION_PROFILES, CommandKind.MOTION_PROFILE): (
        Longitudinal.CLOSED_LOOP,
        Lateral.CLOSED_LOOP,
    ),
    (ControlMode.WRENCH_EFFORTS, CommandKind.WRENCH_EFFORT): (Longitudinal.OPEN_LOOP, Lateral.OPEN_LOOP),
}


def columns(devices: object, control: object, ready: object, partial: object, kind: object) -> ModeInputs:
    parts = (np.atleast_1d(part) for part in (control, ready, partial, kind))
    return ModeInputs(np.atleast_1d(devices).astype(np.uint16), *(part.astype(np.uint8) for part in parts))


def resolve_one(
    devices: int = 16,
    control: ControlMode = ControlMode.MOTION_PROFILES,
    kind: CommandKind = CommandKind.MOTION_PROFILE,
    partial: int = 0,
    without_command: PauseSteering = PauseSteering.HOLD_CURVATURE,
) -> tuple[SafetyMode, Longitudinal, Lateral]:
    answer = resolve(columns(devices, control, ReadyMode.READY, partial, kind), without_command)
    return (
        SafetyMode(int(answer.safety_mode[0])),
        Longitudinal(int(answer.longitudinal[0])),
        Lateral(int(answer.lateral[0])),
    )


@pytest.fixture(scope="module", params=list(PauseSteering))
def everything(request: pytest.FixtureRequest) -> tuple[PauseSteering, Resolution]:
    return request.param, resolve(columns(*EVERYTHING), request.param)


def test_disable_brakes_fully_and_is_never_masked_xgv_31(
    everything: tuple[PauseSteering, Resolution],
) -> None:
    _, answer = everything
    devices, control = EVERYTHING[0], EVERYTHING[1]
    demanded = (devices & (4 | 32) > 0) & (control != ControlMode.UNKNOWN)
    np.testing.assert_array_equal(answer.longitudinal == Longitudinal.FULL_BRAKE, demanded)
    assert (answer.lateral[demanded] == Lateral.FREE).all()
    assert not (answer.speed_engaged | answer.steering_engaged)[demanded].any()
    assert answer.stop_demanded[demanded].all()


def test_no_pause_ever_lets_the_throttle_act_xgv_33(everything: tuple[PauseSteering, Resolution]) -> None:
    _, answer = everything
    paused = (answer.safety_mode == SafetyMode.SOFTWARE_PAUSE) | (
        answer.safety_mode == SafetyMode.ESTOP_PAUSE
    )
    manual_speed = EVERYTHING[3] & 2 > 0
    assert (answer.longitudinal[paused & ~manual_speed] == Longitudinal.CONTROLLED_STOP).all()
    assert (answer.longitudinal[paused & manual_speed] == Longitudinal.FREE).all()


def test_partial_mode_is_ignored_outside_its_three_modes_xgv_39(
    everything: tuple[PauseSteering, Resolution],
) -> None:
    _, answer = everything
    shape = (2048, 4, 3, 4, 3)
    safety = answer.safety_mode.reshape(shape)
    outside = ~np.isin(safety[:, :, :, 0, :], [int(mode) for mode in BY_WIRE])
    for column in (answer.longitudinal, answer.lateral, answer.speed_engaged, answer.steering_engaged):
        by_partial = column.reshape(shape)
        for partial in range(1, 4):
            np.testing.assert_array_equal(
                by_partial[:, :, :, partial, :][outside], by_partial[:, :, :, 0, :][outside]
            )
    for partial in range(1, 4):  # and it never changes the safety mode itself
        np.testing.assert_array_equal(safety[:, :, :, partial, :], safety[:, :, :, 0, :])


def expected_axes(
    mode: SafetyMode, devices: int, control: int, kind: int, partial: int, without: PauseSteering
) -> tuple[Longitudinal, Lateral]:
    """The table of the architecture, row by row."""
    if mode not in BY_WIRE:
        return (Longitudinal.FULL_BRAKE if mode == 11 else Longitudinal.FREE), Lateral.FREE
    live = LIVE.get((ControlMode(control), CommandKind(kind)))
    no_command = Lateral.LATCH_LAST if without is PauseSteering.HOLD_ANGLE else Lateral.CLOSED_LOOP
    longitudinal, lateral = live or (Longitudinal.CONTROLLED_STOP, no_command)
    if mode != SafetyMode.DRIVE_BY_WIRE:
        longitudinal = Longitudinal.CONTROLLED_STOP
    if devices & (512 | 1024):
        lateral = Lateral.FREE
    return (
        Longitudinal.FREE if partial & 2 else longitudinal,
        Lateral.FREE if partial & 1 else lateral,
    )


def test_axes_over_every_input_xgv_16_xgv_33_xgv_35_xgv_69_xgv_70(
    everything: tuple[PauseSteering, Resolution],
) -> None:
    without, answer = everything
    seen = np.stack(
        [
            answer.safety_mode,
            EVERYTHING[0] & (512 | 1024),
            EVERYTHING[1],
            EVERYTHING[4],
            EVERYTHING[3],
            answer.longitudinal,
            answer.lateral,
        ]
    )
    keys = np.ravel_multi_index(seen, tuple(seen.max(axis=1) + 1))  # one number each: quick to compare
    different = seen[:, np.unique(keys, return_index=True)[1]].T.tolist()
    assert len(different) > 300  # every mode in many combinations
    for mode, devices, control, kind, partial, longitudinal, lateral in different:
        expected = expected_axes(SafetyMode(mode), devices, control, kind, partial, without)
        assert (longitudinal, lateral) == expected, (mode, devices, control, kind, partial)


def test_run_state_is_drive_by_wire_with_a_live_command(everything: tuple[PauseSteering, Resolution]) -> None:
    _, answer = everything
    _, control, ready, _, kind = EVERYTHING
    live = ((control == 3) & (kind == CommandKind.MOTION_PROFILE)) | (
        (control == 2) & (kind == CommandKind.WRENCH_EFFORT)
    )
    clear = (EVERYTHING[0] & ~24 == 0) & (ready == ReadyMode.READY)
    np.testing.assert_array_equal(answer.in_run_state, live & clear)


def test_pausing_is_software_pause_and_estop_pause_xgv_41(
    everything: tuple[PauseSteering, Resolution],
) -> None:
    _, answer = everything
    np.testing.assert_array_equal(answer.pausing, np.isin(answer.safety_mode, [2, 8]))


def test_stop_is_demanded_by_estop_pause_and_disable_alone(
    everything: tuple[PauseSteering, Resolution],
) -> None:
    _, answer = everything
    np.testing.assert_array_equal(answer.stop_demanded, np.isin(answer.safety_mode, [8, 11]))


def test_driver_has_at_once_what_he_took_himself_xgv_64(everything: tuple[PauseSteering, Resolution]) -> None:
    _, answer = everything
    overridden = np.isin(answer.safety_mode, [0, 9, 10])
    partial_acts = np.isin(answer.safety_mode, [1, 2, 8])
    for bit, engaged in ((1, answer.steering_engaged), (2, answer.speed_engaged)):
        np.testing.assert_array_equal(engaged, overridden | (partial_acts & (EVERYTHING[3] & bit > 0)))


@pytest.mark.parametrize("devices", [16 | 64, 16 | 2])
def test_both_pauses_steer_on_and_brake_alike_xgv_28_xgv_33(devices: int) -> None:
    _, longitudinal, lateral = resolve_one(devices)
    assert (longitudinal, lateral) == (Longitudinal.CONTROLLED_STOP, Lateral.CLOSED_LOOP)


def test_drive_by_wire_before_the_first_command_stops_and_holds_xgv_70() -> None:
    mode, longitudinal, _ = resolve_one(kind=CommandKind.NONE)
    assert (mode, longitudinal) == (SafetyMode.DRIVE_BY_WIRE, Longitudinal.CONTROLLED_STOP)


@pytest.mark.parametrize(
    ("without", "lateral"),
    [
        (PauseSteering.HOLD_CURVATURE, Lateral.CLOSED_LOOP),
        (PauseSteering.CENTRE, Lateral.CLOSED_LOOP),
        (PauseSteering.HOLD_ANGLE, Lateral.LATCH_LAST),
    ],
)
def test_pause_without_command_xgv_35(without: PauseSteering, lateral: Lateral) -> None:
    answer = resolve_one(16 | 128, kind=CommandKind.NONE, without_command=without)
    assert answer == (SafetyMode.SOFTWARE_PAUSE, Longitudinal.CONTROLLED_STOP, lateral)


def test_manual_steering_leaves_speed_to_the_computer_xgv_39() -> None:
    assert resolve_one(partial=1)[1:] == (Longitudinal.CLOSED_LOOP, Lateral.FREE)
    assert resolve_one(partial=2)[1:] == (Longitudinal.FREE, Lateral.CLOSED_LOOP)


@pytest.mark.parametrize("bits", [512, 1024, 512 | 1024])
def test_uninitialised_steering_is_under_nobodys_control_xgv_69(bits: int) -> None:
    assert resolve_one(16 | bits) == (SafetyMode.SOFTWARE_PAUSE, Longitudinal.CONTROLLED_STOP, Lateral.FREE)


def test_uninitialised_steering_alone_takes_the_wheel_away_xgv_69() -> None:
    scalar = resolve_lateral(
        SafetyMode.SOFTWARE_PAUSE,
        ControlMode.MOTION_PROFILES,
        CommandKind.MOTION_PROFILE,
        0,
        steering_initialised=False,
    )
    assert scalar is Lateral.FREE


def test_unknown_control_mode_is_an_inactive_system_xgv_01_xgv_32() -> None:
    answer = resolve(columns(16 | 4, 0, 0, 0, 0), PauseSteering.HOLD_CURVATURE)
    assert answer.safety_mode[0] == SafetyMode.INACTIVE
    assert (answer.longitudinal[0], answer.lateral[0]) == (Longitudinal.FREE, Lateral.FREE)


def test_look_up_keeps_shape_and_types() -> None:
    answer = resolve(columns(*EVERYTHING[:, :7]), PauseSteering.HOLD_CURVATURE)
    assert {column.shape for column in answer} == {(7,)}
    assert [column.dtype for column in answer] == [np.uint8] * 3 + [np.bool_] * 5
    assert SOFTWARE_READY_TABLE.sum() == 2


def test_reserved_device_bits_are_ignored_xgv_52() -> None:
    assert resolve_one(16 | 1 << 15)[0] is SafetyMode.DRIVE_BY_WIRE
