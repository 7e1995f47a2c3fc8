"""What the codes of the modes mean to a client."""

from __future__ import annotations

import pytest

from jaus.vehicle_mode import SafetyMode, safety_mode_of


@pytest.mark.parametrize("code", range(256))
def test_every_code_of_the_safety_mode_means_something_xgv_50(code: int) -> None:
    """XGV-50: 2 to 7 all are software pause; 12 to 255 are reserved, so what they mean is unknown."""
    expected = {
        1: SafetyMode.DRIVE_BY_WIRE,
        **dict.fromkeys(range(2, 8), SafetyMode.SOFTWARE_PAUSE),
        8: SafetyMode.ESTOP_PAUSE,
        9: SafetyMode.MANUAL_OVERRIDE,
        10: SafetyMode.EMERGENCY_MANUAL_OVERRIDE,
        11: SafetyMode.ESTOP_DISABLE,
    }.get(code, SafetyMode.INACTIVE)
    assert safety_mode_of(code) is expected
