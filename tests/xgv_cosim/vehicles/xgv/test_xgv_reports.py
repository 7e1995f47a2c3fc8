"""Report Vehicle Mode and the secondary status, over all their inputs."""

from __future__ import annotations

from itertools import product

import pytest

from jaus.vehicle_mode import ControlMode, ReadyMode, SafetyMode
from xgv_cosim.vehicles.base import VehicleModeReport
from xgv_cosim.vehicles.xgv.modes import DEVICE_WORDS
from xgv_cosim.vehicles.xgv.profile import XgvProfile
from xgv_cosim.vehicles.xgv.reports import secondary_status, vehicle_mode_report
from xgv_cosim.vehicles.xgv.settings import Firmware, XgvSettings


@pytest.mark.parametrize(("control", "ready", "safety"), list(product(ControlMode, ReadyMode, SafetyMode)))
def test_codes_of_the_modes_xgv_47_xgv_48_xgv_49_xgv_50(
    control: ControlMode, ready: ReadyMode, safety: SafetyMode
) -> None:
    report = vehicle_mode_report(control, ready, safety, 1, 0x12)
    if safety is SafetyMode.INACTIVE:
        assert report is None  # XGV-32: the node is silent
    else:
        assert report == VehicleModeReport(0, int(control), int(ready), int(safety), 1, 0x12)


def test_mode_codes_are_those_of_the_note_xgv_48_xgv_49_xgv_50_xgv_54() -> None:
    """The table's damaged rows hide no value: the enumerations of the text are complete."""
    assert {mode.name: int(mode) for mode in ControlMode} == {
        "UNKNOWN": 0,
        "SOFTWARE_PAUSE": 1,
        "WRENCH_EFFORTS": 2,
        "MOTION_PROFILES": 3,
    }
    assert {mode.name: int(mode) for mode in ReadyMode} == {"UNKNOWN": 0, "SOFTWARE_PAUSE": 1, "READY": 2}
    codes = {mode.name: int(mode) for mode in SafetyMode if mode is not SafetyMode.INACTIVE}
    assert codes == {
        "DRIVE_BY_WIRE": 1,
        "SOFTWARE_PAUSE": 2,
        "ESTOP_PAUSE": 8,
        "MANUAL_OVERRIDE": 9,
        "EMERGENCY_MANUAL_OVERRIDE": 10,
        "ESTOP_DISABLE": 11,
    }


def test_reserved_bits_are_reported_0_xgv_51_xgv_52() -> None:
    for partial, devices in product(range(256), (0, 0x7FF, 0x800, 0xF800, 0xFFFF)):
        report = vehicle_mode_report(2, 2, 1, partial, devices)
        assert report is not None
        assert report.partial_mode == partial % 4
        assert report.safety_devices == devices % 0x800


SECONDARY_BITS = {0: 16, 1: 17, 2: 18, 3: 19, 4: 20, 5: 21, 6: 24, 7: 25, 8: 26, 9: 27, 10: 28}
"""Bit of Report Vehicle Mode, field 6, and the bit that tells the same in the secondary status."""


def test_secondary_status_over_every_input_xgv_46() -> None:
    for devices, partial in product(range(DEVICE_WORDS), range(4)):
        expected = sum(1 << to for of, to in SECONDARY_BITS.items() if devices >> of & 1)
        expected |= (partial & 1) << 22 | (partial >> 1) << 23
        assert secondary_status(partial, devices) == expected


def test_secondary_status_has_no_reserved_bits_xgv_46() -> None:
    assert secondary_status(0xFF, 0xFFFF) == 0x1FFF0000


@pytest.mark.parametrize(("firmware", "known"), [("1.0", False), ("1.1", False), ("1.2", True)])
def test_old_firmware_lacks_the_report_but_not_the_status_xgv_44_xgv_45_xgv_53(
    firmware: str, known: bool
) -> None:
    profile = XgvProfile(XgvSettings(firmware=Firmware(firmware)))
    assert (profile.vehicle_mode_report(2, 2, 1, 0, 0) is not None) is known
    assert profile.secondary_status(0, 1) == 1 << 16
