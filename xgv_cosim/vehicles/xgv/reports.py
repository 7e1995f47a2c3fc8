"""What the XGV reports of its modes and devices, as values: Report Vehicle Mode and the secondary status.

Both tell the same facts in different orders (XGV-46, XGV-52); no byte is packed here.
"""

from __future__ import annotations

from jaus.vehicle_mode import SafetyMode
from xgv_cosim.vehicles.base import VehicleModeReport
from xgv_cosim.vehicles.xgv.modes import DEVICE_WORDS, MANUAL_SPEED, MANUAL_STEERING
from xgv_cosim.vehicles.xgv.settings import Firmware

REPORT_VERSION = 0
"""Version of Report Vehicle Mode (XGV-47)."""
_PARTIAL_BITS = MANUAL_STEERING | MANUAL_SPEED
_LINK_AND_BUTTON_END = 6
"""Device bits below this stand before the two partial bits in the secondary status, the others after."""
_SECONDARY_START = 16


def vehicle_mode_report(
    control_mode: int,
    ready_mode: int,
    safety_mode: int,
    partial_mode: int,
    safety_devices: int,
    *,
    firmware: Firmware = Firmware.V1_2,
) -> VehicleModeReport | None:
    """Return the fields of Report Vehicle Mode (XGV-47 to XGV-52).

    None: the node is silent, because the system is not active (XGV-32) or its firmware is 1.0 or 1.1,
    which does not know the message (XGV-53). Reserved bits are 0.
    """
    if safety_mode == SafetyMode.INACTIVE or firmware in {Firmware.V1_0, Firmware.V1_1}:
        return None
    return VehicleModeReport(
        version=REPORT_VERSION,
        control_mode=control_mode,
        ready_mode=ready_mode,
        safety_mode=safety_mode,
        partial_mode=partial_mode & _PARTIAL_BITS,
        safety_devices=safety_devices & (DEVICE_WORDS - 1),
    )


def secondary_status(partial_mode: int, safety_devices: int) -> int:
    """Return the 32-bit secondary status of Report Component Status (XGV-46).

    From bit 16 on: manual override, pause, stop, link (two bits), external e-stop, manual steering,
    manual speed, door, errors, emergency override, steering needs initialisation, awaiting the user.
    """
    devices = safety_devices & (DEVICE_WORDS - 1)
    below = devices & ((1 << _LINK_AND_BUTTON_END) - 1)
    above = devices >> _LINK_AND_BUTTON_END
    packed = below | (partial_mode & _PARTIAL_BITS) << _LINK_AND_BUTTON_END
    return (packed | above << (_LINK_AND_BUTTON_END + 2)) << _SECONDARY_START
