"""Set Discrete Devices and Set Signals: who may move gear, engine, parking brake, lights, horn, and when.

Engine, horn, lights and signals cause no motion and keep working in a pause, whatever the control mode
(XGV-34), and so does setting the parking brake; a gear shift is motion-related, and so is releasing the
parking brake. Where the human has all systems (XGV-13, XGV-29 to 31) the computer has none of them; in
manual speed he has gear and parking brake (XGV-41).
"""

from __future__ import annotations

from jaus.address import JausAddress
from jaus.component import Standing
from jaus.vehicle_mode import ControlMode, SafetyMode
from xgv_cosim.commands import DiscreteDevices, Headlights, Signals, Turn
from xgv_cosim.endpoint import DevicesCommanded, EndpointChanged, EndpointEvent, MessageRefused
from xgv_cosim.vehicles.xgv.modes import PARTIAL_MODE_ACTS_IN, PAUSES

SIGNALS_OFF = Signals(turn=Turn.OFF, horn=False, headlights=Headlights.OFF)
_IN_CONTROL = frozenset({Standing.CONTROLLER, Standing.DEPUTY})


class Auxiliaries:
    """Takes Set Discrete Devices and Set Signals, and remembers lights and horn.

    Args:
        needs_control: The engine is switched in a pause only by a controller.
    """

    def __init__(self, *, needs_control: bool) -> None:
        self._needs_control = needs_control
        self.signals = SIGNALS_OFF
        """Lights and horn as the computer has them."""
        self.manual_speed = False
        """The human has the speed: bit 1 of the partial mode (XGV-41, XGV-51)."""

    def take_devices(
        self, message: DiscreteDevices, safety_mode: SafetyMode, control_mode: ControlMode, standing: Standing
    ) -> list[EndpointEvent]:
        """Shift and switch what is permitted, refuse the rest (XGV-09, XGV-34)."""
        gear_no = engine_no = parking_no = ""
        if message.gear is not None:
            gear_no = gear_refusal(safety_mode, control_mode, standing, manual_speed=self.manual_speed)
        if message.engine_on is not None:
            engine_no = engine_refusal(safety_mode, standing, needs_control=self._needs_control)
        if message.parking_brake is not None:
            parking_no = parking_brake_refusal(
                safety_mode,
                standing,
                sets=message.parking_brake,
                manual_speed=self.manual_speed,
                needs_control=self._needs_control,
            )
        permitted = DevicesCommanded(
            gear=None if gear_no else message.gear,
            engine_on=None if engine_no else message.engine_on,
            parking_brake=None if parking_no else message.parking_brake,
        )
        answers = (("gear", gear_no), ("engine", engine_no), ("parking brake", parking_no))
        refusals = [f"{what}: {why}" for what, why in answers if why]
        events: list[EndpointEvent] = [] if permitted == DevicesCommanded() else [permitted]
        return events + ([MessageRefused(message, "; ".join(refusals))] if refusals else [])

    def take_signals(
        self, message: Signals, safety_mode: SafetyMode, sender: JausAddress
    ) -> list[EndpointEvent]:
        """Set lights and horn for anyone (XGV-10), unless the human has all systems (XGV-31)."""
        reason = signals_refusal(safety_mode)
        if reason:
            return [MessageRefused(message, reason)]
        return self._enter(signals_after(self.signals, message), f"set by {sender}")

    def release(self, safety_mode: SafetyMode) -> list[EndpointEvent]:
        """Leave lights and horn to the human: what the computer had switched on goes off (XGV-31)."""
        return self._enter(SIGNALS_OFF, f"manual in {_words(safety_mode)}")

    def _enter(self, after: Signals, reason: str) -> list[EndpointEvent]:
        """Return the event of a change, nothing for a mere repeat."""
        before, self.signals = self.signals, after
        if before == after:
            return []
        return [EndpointChanged("signals", signals_text(before), signals_text(after), (reason,))]


def gear_refusal(
    safety_mode: SafetyMode, control_mode: ControlMode, standing: Standing, *, manual_speed: bool
) -> str:
    """Return why a gear shift is refused, empty if it is not (XGV-09, XGV-16, XGV-34, XGV-41).

    Args:
        safety_mode: In force now.
        control_mode: In force now.
        standing: How the sender stands to the Primitive Driver.
        manual_speed: The partial mode leaves the speed to the human.
    """
    if safety_mode in PAUSES:
        return f"a gear shift is motion-related and refused in {_words(safety_mode)} (XGV-34)"
    if safety_mode is not SafetyMode.DRIVE_BY_WIRE:
        return _manual(safety_mode)
    if manual_speed:
        return "in manual speed the gear belongs to the human (XGV-41)"
    if standing not in _IN_CONTROL:
        return "only the controller of the Primitive Driver shifts gears"
    if control_mode is not ControlMode.WRENCH_EFFORTS:
        return "in motion profiles the XGV's own controllers choose the gear (XGV-06, XGV-16)"
    return ""


def engine_refusal(safety_mode: SafetyMode, standing: Standing, *, needs_control: bool) -> str:
    """Return why the engine is not switched, empty if it is (XGV-34).

    In a pause anyone may, so that a disabled and released car can be started again, unless
    ``needs_control``; in drive-by-wire only the controller of the Primitive Driver, or of the Motion
    Profile Driver that controls it.
    """
    if safety_mode not in PARTIAL_MODE_ACTS_IN:
        return _manual(safety_mode)
    if standing in _IN_CONTROL or (safety_mode in PAUSES and not needs_control):
        return ""
    if safety_mode in PAUSES:
        return "only a controller switches the engine (xgv.nonmotion.needs_control)"
    return f"only a controller switches the engine in {_words(safety_mode)}"


def parking_brake_refusal(
    safety_mode: SafetyMode, standing: Standing, *, sets: bool, manual_speed: bool, needs_control: bool
) -> str:
    """Return why the parking brake is not moved, empty if it is (XGV-34, XGV-60).

    To set it stops or holds the car and causes no motion: as with the engine, in a pause anyone may,
    unless ``needs_control``. To release it lets the car roll: motion-related, refused in a pause.

    Args:
        safety_mode: In force now.
        standing: How the sender stands to the Primitive Driver.
        sets: The parking brake is to be set, else released.
        manual_speed: The partial mode leaves the speed to the human, and all its brakes (XGV-41).
        needs_control: In a pause, too, only a controller sets it.
    """
    if safety_mode not in PARTIAL_MODE_ACTS_IN:
        return _manual(safety_mode)
    if manual_speed:
        return "in manual speed the brakes belong to the human (XGV-41)"
    if safety_mode in PAUSES and not sets:
        return f"releasing it is motion-related and refused in {_words(safety_mode)} (XGV-34)"
    if standing in _IN_CONTROL or (safety_mode in PAUSES and not needs_control):
        return ""
    if safety_mode in PAUSES:
        return "only a controller sets it (xgv.nonmotion.needs_control)"
    return f"only a controller moves it in {_words(safety_mode)}"


def signals_refusal(safety_mode: SafetyMode) -> str:
    """Return why Set Signals is refused, empty if it is not; anyone may send it (XGV-10, XGV-31)."""
    return "" if safety_mode in PARTIAL_MODE_ACTS_IN else _manual(safety_mode)


def signals_after(before: Signals, command: Signals) -> Signals:
    """Return the signals with what the command names changed."""
    return Signals(
        turn=before.turn if command.turn is None else command.turn,
        horn=before.horn if command.horn is None else command.horn,
        headlights=before.headlights if command.headlights is None else command.headlights,
    )


def signals_text(signals: Signals) -> str:
    """Return what is on, in words."""
    on = []
    if signals.turn:
        on.append(f"turn {signals.turn.name.lower()}")
    if signals.horn:
        on.append("horn")
    if signals.headlights:
        on.append(f"headlights {signals.headlights.name.lower()}")
    return ", ".join(on) or "off"


def _manual(safety_mode: SafetyMode) -> str:
    return f"in {_words(safety_mode)} the computer has none of these devices"


def _words(safety_mode: SafetyMode) -> str:
    return safety_mode.name.lower().replace("_", " ")
