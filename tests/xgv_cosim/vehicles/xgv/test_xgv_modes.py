"""Control, ready and safety mode of the XGV over every input, against independent wordings."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus
from jaus.vehicle_mode import ControlMode, ReadyMode, SafetyMode
from xgv_cosim.vehicles.xgv.modes import (
    is_software_ready,
    resolve_control_mode,
    resolve_ready_mode,
    resolve_safety_mode,
)
from xgv_cosim.vehicles.xgv.settings import BothClients
from xgv_cosim.vehicles.xgv.tables import SAFETY_MODE_TABLE

MPD = JausAddress(1, 1, ComponentId.MOTION_PROFILE_DRIVER, 1)
ALICE = JausAddress(1, 2, 4, 1)
BOB = JausAddress(1, 3, 4, 1)

# Report Vehicle Mode, field 6, copied from the note's table, not from the code (XGV-52).
OVERRIDE, PAUSE, STOP, BUTTON, DOOR, ERRORS, EMO, UNINIT, AWAITS = 1, 2, 4, 32, 64, 128, 256, 512, 1024


def flowchart(devices: int, software_ready: bool) -> int:
    """Figure B as a chain of first matches (XGV-26 to XGV-32); wire codes of XGV-50."""
    if devices & STOP or devices & BUTTON:
        return 11
    if devices & EMO:
        return 10
    if devices & OVERRIDE:
        return 9
    if devices & PAUSE:
        return 8
    for unsafe in (DOOR, ERRORS, UNINIT, AWAITS):
        if devices & unsafe:
            return 2
    return 1 if software_ready else 2


def test_safety_mode_over_all_4096_inputs_xgv_26_to_32() -> None:
    for devices, ready in product(range(2048), (False, True)):
        mode = resolve_safety_mode(devices, software_ready=ready)
        assert mode == flowchart(devices, ready), (devices, ready)
        assert SAFETY_MODE_TABLE[int(ready), devices] == mode


def test_link_status_never_changes_the_mode_xgv_42() -> None:
    for link in range(4):
        with_link = SAFETY_MODE_TABLE[:, [word for word in range(2048) if word >> 3 & 3 == link]]
        without = SAFETY_MODE_TABLE[:, [word for word in range(2048) if word >> 3 & 3 == 0]]
        np.testing.assert_array_equal(with_link, without)


def test_disable_is_masked_by_nothing_but_inactive_xgv_31_xgv_32() -> None:
    for devices, ready in product(range(2048), (False, True)):
        disabled = bool(devices & (STOP | BUTTON))
        assert (SAFETY_MODE_TABLE[int(ready), devices] == 11) == disabled
        assert resolve_safety_mode(devices, software_ready=ready, active=False) is SafetyMode.INACTIVE


def test_drive_by_wire_needs_everything_clear_xgv_26() -> None:
    clear = [word for word in range(2048) if not word & ~(3 << 3)]
    assert np.flatnonzero(SAFETY_MODE_TABLE[1] == 1).tolist() == clear
    assert not (SAFETY_MODE_TABLE[0] == 1).any()


def test_wire_codes_xgv_48_xgv_49_xgv_50() -> None:
    assert [int(mode) for mode in ControlMode] == [0, 1, 2, 3]
    assert (ControlMode.SOFTWARE_PAUSE, ControlMode.WRENCH_EFFORTS, ControlMode.MOTION_PROFILES) == (1, 2, 3)
    assert (ReadyMode.SOFTWARE_PAUSE, ReadyMode.READY) == (1, 2)
    assert set(np.unique(SAFETY_MODE_TABLE).tolist()) == {1, 2, 8, 9, 10, 11}


@pytest.mark.parametrize("both_clients", list(BothClients))
@pytest.mark.parametrize("mpd_controller", [None, ALICE, BOB])
@pytest.mark.parametrize("pd_controller", [None, ALICE, BOB, MPD])
def test_control_mode_over_all_holders_xgv_18(
    pd_controller: JausAddress | None, mpd_controller: JausAddress | None, both_clients: BothClients
) -> None:
    configurations = {
        (ALICE, None): ControlMode.WRENCH_EFFORTS,
        (BOB, None): ControlMode.WRENCH_EFFORTS,
        (MPD, ALICE): ControlMode.MOTION_PROFILES,
        (MPD, BOB): ControlMode.MOTION_PROFILES,
    }
    if both_clients is BothClients.WRENCH_EFFORTS:
        configurations[ALICE, ALICE] = configurations[BOB, BOB] = ControlMode.WRENCH_EFFORTS
    mode = resolve_control_mode(pd_controller, mpd_controller, mpd_address=MPD, both_clients=both_clients)
    assert mode is configurations.get((pd_controller, mpd_controller), ControlMode.SOFTWARE_PAUSE)


def test_ready_mode_over_every_status_xgv_22_xgv_23_xgv_24() -> None:
    for control, pd, mpd in product(ControlMode, ComponentStatus, ComponentStatus):
        needed = {ControlMode.WRENCH_EFFORTS: (pd,), ControlMode.MOTION_PROFILES: (pd, mpd)}.get(control)
        ready = needed is not None and set(needed) == {ComponentStatus.READY}
        expected = ReadyMode.READY if ready else ReadyMode.SOFTWARE_PAUSE
        assert resolve_ready_mode(control, pd, mpd) is expected, (control, pd, mpd)


def test_emergency_status_only_takes_readiness_away_xgv_63() -> None:
    mode = resolve_ready_mode(ControlMode.WRENCH_EFFORTS, ComponentStatus.EMERGENCY, ComponentStatus.READY)
    assert mode is ReadyMode.SOFTWARE_PAUSE


def test_software_ready_needs_both_modes_xgv_26() -> None:
    ready = {(c, r) for c, r in product(ControlMode, ReadyMode) if is_software_ready(c, r)}
    assert ready == {
        (ControlMode.WRENCH_EFFORTS, ReadyMode.READY),
        (ControlMode.MOTION_PROFILES, ReadyMode.READY),
    }
