"""Getting control of a car and keeping it drivable, as the public clients do."""

from __future__ import annotations

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus, StatusCommand
from xgv_cosim.commands import DiscreteDevices
from xgv_cosim.endpoint import CommandStatus, ReleaseControl, RequestControl, StackMessage
from xgv_cosim.observation import Observation

PD = ComponentId.PRIMITIVE_DRIVER
MPD = ComponentId.MOTION_PROFILE_DRIVER

DRIVES = "drive_by_wire"
PAUSES = frozenset({"software_pause", "estop_pause"})
"""Safety modes in which the engine may be started although the car may not drive (XGV-34)."""


def closed_loop_session(
    seen: Observation, address: JausAddress, authority: int, *, takes_over: bool = True
) -> list[StackMessage]:
    """Return what is missing for closed-loop control, in the order of the public clients (XGV-17..20).

    Args:
        seen: The view.
        address: The stack's own.
        authority: With which it asks.
        takes_over: Whether to take the car now, if another drives it.
    """
    if seen.safety_mode != DRIVES and not takes_over:
        return []
    messages: list[StackMessage] = []
    if seen.component_controller[MPD] != address:
        if seen.component_controller[PD] == address:
            messages.append(ReleaseControl(PD))
        messages.append(RequestControl(MPD, authority))
    return messages + _resumed(seen, PD, MPD) + _drivable(seen, MPD, address)


def open_loop_session(
    seen: Observation, address: JausAddress, authority: int, *, takes_over: bool = True
) -> list[StackMessage]:
    """Return what is missing for wrench efforts: the Primitive Driver alone (XGV-18)."""
    if seen.safety_mode != DRIVES and not takes_over:
        return []
    messages: list[StackMessage] = []
    if seen.component_controller[PD] != address:
        if seen.component_controller[MPD] == address:
            messages.append(ReleaseControl(MPD))
        messages.append(RequestControl(PD, authority))
    return messages + _resumed(seen, PD) + _drivable(seen, PD, address)


def _resumed(seen: Observation, *components: ComponentId) -> list[StackMessage]:
    return [
        CommandStatus(component, StatusCommand.RESUME)
        for component in components
        if seen.component_status[component] == ComponentStatus.STANDBY
    ]


def _drivable(seen: Observation, component: ComponentId, address: JausAddress) -> list[StackMessage]:
    """Return what makes a car drive again that stands with its engine off or its parking brake set.

    Only as the one who controls it: a car that another drives is his.
    """
    if seen.component_controller[component] != address:
        return []
    drives = seen.safety_mode == DRIVES
    starts = not seen.devices.engine_on and (drives or seen.safety_mode in PAUSES)
    releases = seen.devices.parking_brake and drives
    if not (starts or releases):
        return []
    return [DiscreteDevices(engine_on=starts or None, parking_brake=False if releases else None)]
