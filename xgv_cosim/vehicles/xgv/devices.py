"""The XGV's safety devices, one object per car: SafeStop, buttons, overrides, doors, and their faults.

What each injection does to an XGV stands in ``EFFECTS``. Devices that are wired set their bit; the
SafeStop's toggle and button act through radio and receiver (``safestop.py``).
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from jaus.vehicle_mode import SafetyMode
from xgv_cosim.endpoint import EndpointChanged
from xgv_cosim.injection import InjectionKind, OperatorAction
from xgv_cosim.vehicles.base import InjectionEffect
from xgv_cosim.vehicles.transmitter import Demand, Transmitter
from xgv_cosim.vehicles.xgv import modes
from xgv_cosim.vehicles.xgv.errors import SAFESTOP_LINK_LOSS
from xgv_cosim.vehicles.xgv.rearm import WORDS, RearmCause, Rearming
from xgv_cosim.vehicles.xgv.safestop import LinkStatus, Receiver, Relay, SafeStopReaction
from xgv_cosim.vehicles.xgv.settings import XgvSettings

EFFECTS: Mapping[InjectionKind, InjectionEffect] = MappingProxyType(
    {
        InjectionKind.ESTOP_PAUSE: InjectionEffect(
            "the SafeStop transmitter's toggle stands at pause", modes.SAFESTOP_PAUSE
        ),
        InjectionKind.ESTOP_DISABLE: InjectionEffect(
            "the SafeStop transmitter's stop button is pressed", modes.SAFESTOP_STOP
        ),
        InjectionKind.ESTOP_BUTTON: InjectionEffect(
            "a hard-wired emergency stop button is pressed, until a hand resets it", modes.ESTOP_BUTTON
        ),
        InjectionKind.OVERRIDE: InjectionEffect(
            "the manual override selector is engaged", modes.MANUAL_OVERRIDE_ENGAGED
        ),
        InjectionKind.EMO: InjectionEffect(
            "the emergency manual override is engaged, which acts without software",
            modes.EMERGENCY_OVERRIDE_ENGAGED,
        ),
        InjectionKind.DOOR: InjectionEffect("a door or the liftgate is open", modes.DOOR_OPEN),
        InjectionKind.STEERING_UNINITIALISED: InjectionEffect(
            "the steering needs initialisation, until an operator has done it", modes.STEERING_UNINITIALISED
        ),
        InjectionKind.STEERING_AWAITS_USER: InjectionEffect(
            "the steering's initialisation waits for an operator's OK", modes.STEERING_AWAITS_USER
        ),
        InjectionKind.ERROR: InjectionEffect("an internal error is detected", raises_error=True),
        InjectionKind.CMD_LOSS: InjectionEffect("nothing that the stack sends arrives"),
        InjectionKind.LINK: InjectionEffect(
            "no frame of the SafeStop's radio arrives; after the time-out link supervision acts"
        ),
        InjectionKind.BYPASS: InjectionEffect("the SafeStop's link supervision is switched off"),
        InjectionKind.RECEIVER_DEAD: InjectionEffect("the SafeStop receiver is dead, its relays fall open"),
        InjectionKind.RELAY_STUCK_PAUSE: InjectionEffect("the SafeStop pause relay no longer moves"),
        InjectionKind.RELAY_STUCK_STOP: InjectionEffect("the SafeStop stop relay no longer moves"),
        InjectionKind.FROZEN: InjectionEffect(
            "the controller is frozen: outputs held, nothing computed or answered"
        ),
        InjectionKind.INACTIVE: InjectionEffect("the system is not booted: a stock car"),
    }
)
"""What each injection does to an XGV (XGV-14, XGV-52, cross-profile rules); other kinds are unsupported."""

_STEERING_KINDS = (InjectionKind.STEERING_UNINITIALISED, InjectionKind.STEERING_AWAITS_USER)
_STRENGTH = {
    **dict.fromkeys(SafetyMode, 0),
    **dict.fromkeys(modes.PAUSES, 1),
    SafetyMode.ESTOP_DISABLE: 2,
}
"""How hard each mode stops the car: not at all, as a pause, with full brake."""
_PAUSE, _DISABLE = _STRENGTH[SafetyMode.ESTOP_PAUSE], _STRENGTH[SafetyMode.ESTOP_DISABLE]
_HAND_HAS_ALL = frozenset(
    {SafetyMode.MANUAL_OVERRIDE, SafetyMode.EMERGENCY_MANUAL_OVERRIDE, SafetyMode.INACTIVE}
)
_STOP_BITS = modes.SAFESTOP_STOP | modes.ESTOP_BUTTON


class XgvDevices:
    """The safety devices of one car. Implements ``vehicles.base.SafetyDevices``.

    Args:
        settings: Settings of the car.
        key: Names car and run; which radio frames are lost follows from it.
        now_s: When the car is bound.
        transmitter: The transmitter that the receiver listens to; None: one of the car's own.
        holder: Under which name what is injected into the car holds the transmitter's controls.
    """

    def __init__(
        self,
        settings: XgvSettings,
        key: str,
        now_s: float,
        transmitter: Transmitter | None = None,
        holder: str = "",
    ) -> None:
        self._link_loss = settings.safestop.link_loss
        self._transmitter = Transmitter() if transmitter is None else transmitter
        self._holder = holder
        self._receiver = Receiver(settings.safestop, self._transmitter, key, now_s)
        self._rearming = Rearming(settings.rearm)
        self._acting: set[InjectionKind] = set()
        self._codes: set[int] = set()
        self._held_bits = 0
        """The device word with which the controller froze, while it is frozen."""
        self._refresh()

    def _refresh(self) -> None:
        """Compute anew what is asked at every tick and changes seldom."""
        self._bits = self._word()
        self._masked: dict[tuple[int, bool, int], Mapping[str, str]] = {}
        self._followed: int | None = None
        self._is_active = InjectionKind.INACTIVE not in self._acting
        self._is_frozen = InjectionKind.FROZEN in self._acting and self._is_active

    @property
    def bits(self) -> int:
        """Return the device word but for bit 7, which the endpoint sets (XGV-52)."""
        return self._bits

    def _word(self) -> int:
        relays = self._receiver.relays
        bits = self._receiver.link << modes.LINK_STATUS_SHIFT
        bits |= modes.SAFESTOP_PAUSE if relays.pause else 0
        bits |= modes.SAFESTOP_STOP if relays.stop else 0
        for kind in self._acting - {InjectionKind.ESTOP_PAUSE, InjectionKind.ESTOP_DISABLE}:
            bits |= EFFECTS[kind].device_bits
        return bits

    @property
    def errors(self) -> frozenset[int]:
        """Return the injected codes, and 9138 while the SafeStop's link is lost (XGV-42)."""
        lost = {SAFESTOP_LINK_LOSS} if self._receiver.link is LinkStatus.NONE else set()
        return frozenset(self._codes | lost)

    @property
    def is_active(self) -> bool:
        """Return whether the system is booted (XGV-01, XGV-32)."""
        return self._is_active

    @property
    def is_frozen(self) -> bool:
        """Return whether the booted controller is frozen (XGV-67)."""
        return self._is_frozen

    @property
    def hears_stack(self) -> bool:
        """Return whether messages from the stack arrive."""
        return InjectionKind.CMD_LOSS not in self._acting

    @property
    def next_deadline_s(self) -> float:
        """Return when the receiver may change by itself."""
        return self._receiver.next_change_s

    @property
    def resume_refusal(self) -> str:
        """Return why Resume is refused (XGV-37)."""
        return self._rearming.refusal

    def apply(
        self, kind: InjectionKind, code: int | None, now_s: float, *, begins: bool
    ) -> list[EndpointChanged]:
        """Let an injection of ``EFFECTS`` begin or end."""
        before, receiver = self._receiver.link, self._receiver
        events: list[EndpointChanged] = []
        if kind is InjectionKind.FROZEN and begins and not self.is_frozen:
            self._held_bits = self.bits
        stop_bits = _STOP_BITS & (self._held_bits if self.is_frozen else self.bits)
        if kind is InjectionKind.INACTIVE and begins and self.is_active and stop_bits:
            why = "going inactive releases the full brake of the e-stop disable"
            events.append(EndpointChanged("disable_released", "estop_disable", "inactive", (why,)))
        if kind is InjectionKind.ERROR:
            if code is not None:
                self._codes.add(code) if begins else self._codes.discard(code)
            return events
        self._acting.add(kind) if begins else self._acting.discard(kind)
        match kind:
            case InjectionKind.ESTOP_PAUSE | InjectionKind.ESTOP_DISABLE:
                self._transmitter.use(kind, self._holder, now_s, begins=begins)
                receiver.advance(now_s)
            case InjectionKind.LINK:
                receiver.set_link(now_s, up=not begins)
            case InjectionKind.BYPASS:
                receiver.set_bypass(now_s, bypass=begins)
            case InjectionKind.RECEIVER_DEAD:
                receiver.set_dead(now_s, dead=begins)
            case InjectionKind.RELAY_STUCK_PAUSE:
                receiver.stick(Relay.PAUSE, now_s, stuck=begins)
            case InjectionKind.RELAY_STUCK_STOP:
                receiver.stick(Relay.STOP, now_s, stuck=begins)
            case _:
                pass  # a wired device or a fault: that it acts is all
        self._refresh()
        return events + self._changes_since(before)

    def handle_deadline(self, now_s: float) -> list[EndpointChanged]:
        """Let the receiver hear what has arrived, or find that nothing does."""
        before = self._receiver.link
        self._receiver.advance(now_s)
        self._refresh()
        return self._changes_since(before)

    def operate(self, action: OperatorAction, now_s: float) -> list[EndpointChanged]:  # noqa: ARG002 - the protocol's
        """Re-arm the car (XGV-37), or initialise its steering (XGV-69)."""
        if action is OperatorAction.INITIALISE_STEERING:
            self._acting -= set(_STEERING_KINDS)
            self._refresh()
            return [EndpointChanged("operator", "", action.value)]
        gone = tuple(f"after the {WORDS[cause]}" for cause in self._rearming.rearm())
        left = (self._rearming.refusal,) if self._rearming.refusal else ()
        return [EndpointChanged("operator", "", action.value, (gone or ("nothing to re-arm",)) + left)]

    def follow_stops(self, endpoint_bits: int) -> str:
        """Take note of the causes of XGV-37 that last now."""
        if endpoint_bits == self._followed:
            return ""  # nothing has changed since
        self._followed = endpoint_bits
        return self._rearming.follow(self._lasting(endpoint_bits))

    def control_preempted(self) -> str:
        """Take note of a pre-emption (XGV-66)."""
        return self._rearming.strike(RearmCause.PREEMPTION)

    def masked_stops(self, safety_mode: int, *, handed_over: bool = True) -> Mapping[str, str]:
        """Return the demands to stop that the mode in force does not meet, and what masks each (XGV-68).

        A pause meets a demand to pause, a disable every one; a stop demanded in a pause and unheard is
        masked like any other. A demand that is only still on its way from the transmitter is not masked.
        """
        key = (
            safety_mode,
            handed_over,
            self._transmitter.revision,
        )  # another car's press may move a shared one
        found = self._masked.get(key)
        if found is None:
            mode = _mode_of(safety_mode)
            met = _STRENGTH[mode] if handed_over or mode is not SafetyMode.SOFTWARE_PAUSE else 0
            if self._is_frozen and mode is SafetyMode.SOFTWARE_PAUSE:
                met = 0  # held for a cause of its own; whatever demands a stop now is not heard
            demanded = self._demanded(mode)
            found = {what: why for what, (why, strength) in demanded.items() if strength > met}
            self._masked[key] = found
        return found

    def masked_override(self, safety_mode: int) -> str:
        """Return why the engaged manual override does not act: the controller is frozen (XGV-13, XGV-67).

        In a disable it does not act by rule (XGV-29, XGV-31), and what the hardware gives to the human it
        need not give.
        """
        mode = _mode_of(safety_mode)
        is_moot = mode in _HAND_HAS_ALL or mode is SafetyMode.ESTOP_DISABLE
        engaged = InjectionKind.OVERRIDE in self._acting
        return "controller frozen" if engaged and self._is_frozen and not is_moot else ""

    def _demanded(self, mode: SafetyMode) -> dict[str, tuple[str, int]]:
        """Return every demand to stop: what would mask it, and how strong it is."""
        receiver, pressed = self._receiver, self._transmitter.demand
        if self.is_frozen:
            by_mode = "controller frozen"
        elif not self.is_active:
            by_mode = "system not active"
        else:
            by_mode = mode.name.lower().replace("_", " ")
        demanded: dict[str, tuple[str, int]] = {}
        if self._is_frozen and InjectionKind.DOOR in self._acting and mode is SafetyMode.DRIVE_BY_WIRE:
            demanded["door or liftgate"] = by_mode, _PAUSE
        if InjectionKind.ESTOP_BUTTON in self._acting:
            demanded["emergency stop button"] = by_mode, _DISABLE
        for relay, is_open, is_wanted, is_pressed, is_missed in zip(
            Relay, receiver.relays, receiver.wanted, pressed, receiver.missed, strict=True
        ):
            strength = _DISABLE if relay is Relay.STOP else _PAUSE
            if is_open:
                demanded[f"SafeStop {relay.value} relay"] = by_mode, strength
            elif is_wanted:
                demanded[f"SafeStop {relay.value}"] = f"{relay.value} relay stuck", strength
            elif is_pressed and receiver.is_silent:
                demanded[f"SafeStop {relay.value}"] = "radio link lost", strength
            elif is_missed:
                demanded[f"SafeStop {relay.value}"] = "radio frames lost", strength
        supervised = self._link_loss is not SafeStopReaction.NONE
        if supervised and receiver.link is LinkStatus.BYPASS and receiver.is_silent:
            by_loss = _DISABLE if self._link_loss is SafeStopReaction.STOP else _PAUSE
            demanded["SafeStop link loss"] = "bypass", by_loss
        return demanded

    def reasons(self, computed: tuple[str, ...]) -> tuple[str, ...]:
        """Return what an inactive or frozen controller cannot say, or what it says (XGV-32, XGV-67)."""
        if not self.is_active:
            return ("system not active",)
        if self.is_frozen:
            by_hardware = InjectionKind.EMO in self._acting
            held = ("controller frozen: last outputs held",)
            return ("emergency manual override", *held) if by_hardware else held
        opened = self._receiver.supervision
        if opened.pause or opened.stop:
            return tuple(_with_cause(reason, opened) for reason in computed)
        return computed

    def _lasting(self, endpoint_bits: int) -> set[RearmCause]:
        bits, supervision = self.bits | endpoint_bits, self._receiver.supervision
        heard = self._receiver.heard
        lasting = set()
        if bits & modes.SAFESTOP_PAUSE and (heard.pause or not supervision.pause):
            lasting.add(RearmCause.ESTOP_PAUSE)
        if bits & modes.ESTOP_BUTTON or (bits & modes.SAFESTOP_STOP and (heard.stop or not supervision.stop)):
            lasting.add(RearmCause.DISABLE)
        if self._receiver.link is LinkStatus.NONE:
            lasting.add(RearmCause.LINK_LOSS)
        for mask, cause in (
            (modes.MANUAL_OVERRIDE_ENGAGED | modes.EMERGENCY_OVERRIDE_ENGAGED, RearmCause.OVERRIDE),
            (modes.ERRORS_DETECTED, RearmCause.ERROR),
            (modes.DOOR_OPEN, RearmCause.DOOR),
        ):
            if bits & mask:
                lasting.add(cause)
        return lasting

    def _changes_since(self, before: LinkStatus) -> list[EndpointChanged]:
        """Return the link's change; the relays speak through the mode that they cause."""
        link = self._receiver.link
        if link is before:
            return []
        return [EndpointChanged("safestop_link", before.name.lower(), link.name.lower())]


def _mode_of(code: int) -> SafetyMode:
    """Return the safety mode of a wire code; 2 to 7 all mean software pause (XGV-50)."""
    return SafetyMode(code) if code not in range(2, 8) else SafetyMode.SOFTWARE_PAUSE


def _with_cause(reason: str, opened: Demand) -> str:
    names = [f"SafeStop {relay.value} relay" for relay, is_open in zip(Relay, opened, strict=True) if is_open]
    return f"{reason}, link lost" if reason in names else reason
