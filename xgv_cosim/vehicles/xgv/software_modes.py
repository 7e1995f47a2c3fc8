"""Control mode and ready mode of one car as they stand, and why: what users' software has asked for."""

from __future__ import annotations

from jaus.vehicle_mode import ControlMode, ReadyMode
from xgv_cosim.endpoint import EndpointChanged
from xgv_cosim.vehicles.xgv.drivers import Drivers
from xgv_cosim.vehicles.xgv.modes import is_software_ready, resolve_control_mode, resolve_ready_mode
from xgv_cosim.vehicles.xgv.reasons import control_mode_reason, ready_mode_reasons
from xgv_cosim.vehicles.xgv.settings import BothClients


class SoftwareModes:
    """Follows who controls the drivers, and their status.

    Args:
        drivers: The two drivers.
        both_clients: Control mode when one client controls both (XGV-18).
    """

    def __init__(self, drivers: Drivers, both_clients: BothClients) -> None:
        self._drivers = drivers
        self._both_clients = both_clients
        self.control = self.control_now()
        """The control mode (XGV-15)."""
        self.ready = self._ready_now()
        """The ready mode (XGV-22, XGV-23, XGV-24)."""

    @property
    def are_ready(self) -> bool:
        """Return whether neither is software pause (XGV-26)."""
        return is_software_ready(self.control, self.ready)

    @property
    def control_reason(self) -> str:
        """Return why the control mode is what it is."""
        why = control_mode_reason(self.control, self._drivers.primitive, self._drivers.profile)
        if self.control is ControlMode.SOFTWARE_PAUSE and self._drivers.loss:
            return f"{why}: {self._drivers.loss}"
        return why

    @property
    def ready_reasons(self) -> tuple[str, ...]:
        """Return what is not ready and why, nothing if all that is needed is."""
        return ready_mode_reasons(
            self.control,
            self._drivers.primitive,
            self._drivers.profile,
            self._drivers.status.standby_reason,
        )

    def control_now(self) -> ControlMode:
        """Return the control mode that follows from who controls the drivers now (XGV-15)."""
        return resolve_control_mode(
            self._drivers.primitive.controller,
            self._drivers.profile.controller,
            mpd_address=self._drivers.profile.address,
            both_clients=self._both_clients,
        )

    def enter(self) -> list[EndpointChanged]:
        """Compute both modes anew and return what has changed."""
        events = []
        before, self.control = self.control, self.control_now()
        if self.control is not before:
            reasons: tuple[str, ...] = (self.control_reason,)
            events.append(
                EndpointChanged("control_mode", before.name.lower(), self.control.name.lower(), reasons)
            )
        was, self.ready = self.ready, self._ready_now()
        if self.ready is not was:
            reasons = self.ready_reasons or ("all that is needed is ready",)
            events.append(EndpointChanged("ready_mode", was.name.lower(), self.ready.name.lower(), reasons))
        return events

    def _ready_now(self) -> ReadyMode:
        return resolve_ready_mode(self.control, self._drivers.primitive.status, self._drivers.profile.status)
