"""The reports of the XGV's six components, of what the car measures and computes (XGV-08, XGV-46 to XGV-61).

Frame of the wire: X forward, Y right, so curvature and steering are positive to the right.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from jaus.address import ComponentId, JausAddress
from jaus.component import ComponentStatus
from jaus.messages import Message
from jaus.messages.core import (
    ReportComponentAuthority,
    ReportComponentControl,
    ReportComponentStatus,
    ReportTime,
)
from jaus.messages.platform import (
    BrakeHornBit,
    ReportDiscreteDevices,
    ReportVelocityState,
    ReportWrenchEffort,
)
from jaus.messages.torc import (
    ReportCurvature,
    ReportErrorCount,
    ReportSignals,
    ReportVehicleMode,
    ReportWheelsSpeed,
)
from jaus.stamps import TimeStamp
from xgv_cosim.vehicles.xgv.settings import Firmware
from xgv_cosim.vehicles.xgv.wire.commands import gear_code, propulsion_bits, wire_signals

if TYPE_CHECKING:
    from xgv_cosim.vehicles.base import VehicleReadings

_NM, _PD, _MPD = ComponentId.NODE_MANAGER, ComponentId.PRIMITIVE_DRIVER, ComponentId.MOTION_PROFILE_DRIVER
_VSS, _SD, _EM = ComponentId.VELOCITY_STATE_SENSOR, ComponentId.SIGNALS_DRIVER, ComponentId.ERROR_MANAGER
VELOCITY_FIELDS = 1 << 0 | 1 << 8
"""Velocity along X and the time stamp: what the real car answers (jaus-wire, fact 7)."""
WRENCH_FIELDS = 1 << 0 | 1 << 5 | 1 << 6
"""Throttle, steering, brake (XGV-59)."""
DEVICE_FIELDS = 1 << 0 | 1 << 1 | 1 << 2
"""Propulsion, parking brake and horn, gear (jaus-wire, fact 7)."""
SIGNAL_FIELDS = 1 << 0 | 1 << 1 | 1 << 2
TIME_FIELDS = 1 << 0
_CORE = {
    ReportComponentAuthority.code: None,
    ReportComponentStatus.code: None,
    ReportComponentControl.code: None,
}
_OF_COMPONENTS: dict[ComponentId, dict[int, int | None]] = {
    _NM: {ReportVehicleMode.code: None, ReportTime.code: TIME_FIELDS},
    _PD: {
        ReportWrenchEffort.code: WRENCH_FIELDS,
        ReportDiscreteDevices.code: DEVICE_FIELDS,
        ReportWheelsSpeed.code: None,
    },
    _MPD: {ReportCurvature.code: None},
    _VSS: {ReportVelocityState.code: VELOCITY_FIELDS},
    _SD: {ReportSignals.code: SIGNAL_FIELDS},
    _EM: {ReportErrorCount.code: None},
}
_MS_OF_A_DAY = 86_400_000


def reports_of(firmware: Firmware) -> dict[int, dict[int, int | None]]:
    """Return by component the supported presence vector of each report, None where it has none.

    Firmware 1.0 and 1.1 does not know Report Vehicle Mode: query and connection are ignored (XGV-53).
    """
    reports = {int(component): {**_CORE, **own} for component, own in _OF_COMPONENTS.items()}
    for component, codes in unknown_to(firmware).items():
        for code in codes:
            del reports[component][code]
    return reports


def unknown_to(firmware: Firmware) -> dict[int, frozenset[int]]:
    """Return by component the reports of which a firmware has never heard (XGV-53)."""
    is_old = firmware in {Firmware.V1_0, Firmware.V1_1}
    return {int(_NM): frozenset({ReportVehicleMode.code})} if is_old else {}


def time_stamp(time_s: float) -> int:
    """Return a simulation time as the wire has it, counted from midnight of the first day of a month."""
    days, ms = divmod(round(1000.0 * time_s), _MS_OF_A_DAY)
    seconds, milliseconds = divmod(ms, 1000)
    minutes, second = divmod(seconds, 60)
    hour, minute = divmod(minutes, 60)
    return TimeStamp(days % 31 + 1, hour, minute, second, milliseconds).packed


class XgvReporter:
    """Makes the reports of one car; a ``jaus.node.Reporter``.

    Args:
        readings: What the car knows of itself now.
    """

    def __init__(self, readings: VehicleReadings) -> None:
        self._readings = readings
        self._makers: Mapping[int, Callable[[int], Message]] = {
            ReportComponentAuthority.code: self._authority,
            ReportComponentStatus.code: self._status,
            ReportComponentControl.code: self._control,
            ReportVehicleMode.code: self._vehicle_mode,
            ReportTime.code: self._time,
            ReportWrenchEffort.code: self._wrench,
            ReportDiscreteDevices.code: self._devices,
            ReportWheelsSpeed.code: self._wheels,
            ReportCurvature.code: self._curvature,
            ReportVelocityState.code: self._velocity,
            ReportSignals.code: self._signals,
            ReportErrorCount.code: self._errors,
        }

    def __call__(self, component: int, code: int) -> Message:
        """Return a report of a component with all its fields."""
        return self._makers[code](component)

    def _status(self, component: int) -> Message:
        """Return Report Component Status; only the two drivers tell of the safety devices (XGV-46)."""
        status = self._readings.component_status.get(ComponentId(component))
        if status is None:
            return ReportComponentStatus(ComponentStatus.READY)
        return ReportComponentStatus(status, self._readings.secondary_status)

    def _control(self, component: int) -> Message:
        driver = ComponentId(component)
        holder: JausAddress | None = self._readings.component_controller.get(driver)
        if holder is None:
            return ReportComponentControl()
        authority = self._readings.component_authority[driver]
        return ReportComponentControl(
            holder.subsystem, holder.node, holder.component, holder.instance, authority
        )

    def _authority(self, component: int) -> Message:
        return ReportComponentAuthority(self._readings.component_authority.get(ComponentId(component), 0))

    def _vehicle_mode(self, _: int) -> Message:
        return ReportVehicleMode(*self._readings.vehicle_mode)

    def _time(self, _: int) -> Message:
        return ReportTime(time_stamp=time_stamp(self._readings.time_s))

    def _wrench(self, _: int) -> Message:
        readings = self._readings
        return ReportWrenchEffort(
            propulsive_linear_x_percent=100.0 * readings.throttle,
            propulsive_rotational_z_percent=-100.0 * readings.steering,
            resistive_linear_x_percent=100.0 * readings.brake,
        )

    def _devices(self, _: int) -> Message:
        devices, signals = self._readings.devices, self._readings.signals
        return ReportDiscreteDevices(
            propulsion_bits=propulsion_bits(engine_on=devices.engine_on),
            brake_horn_bits=devices.parking_brake << BrakeHornBit.PARKING_BRAKE
            | bool(signals.horn) << BrakeHornBit.HORN,
            gear=gear_code(devices.gear),
        )

    def _wheels(self, _: int) -> Message:
        front_left, front_right, rear_left, rear_right = self._readings.wheel_speeds_mps
        stamp = time_stamp(self._readings.time_s)
        return ReportWheelsSpeed(0, front_right, front_left, rear_right, rear_left, stamp)

    def _curvature(self, _: int) -> Message:
        stamp = time_stamp(self._readings.time_s)
        return ReportCurvature(1, -math.atan(self._readings.curvature_per_m), stamp)

    def _velocity(self, _: int) -> Message:
        return ReportVelocityState(
            velocity_x_mps=self._readings.speed_mps, time_stamp=time_stamp(self._readings.time_s)
        )

    def _signals(self, _: int) -> Message:
        turn, horn, lights = wire_signals(self._readings.signals)
        return ReportSignals(turn_signal=turn, horn=horn, lights=lights)

    def _errors(self, _: int) -> Message:
        return ReportErrorCount(errors=tuple(sorted(self._readings.errors)))
