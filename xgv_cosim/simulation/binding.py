"""How a vehicle of the world is bound, and the objects one bound vehicle owns."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum

from jaus.address import JausAddress
from xgv_cosim.actuation import CouplingKind, Driver
from xgv_cosim.endpoint import Endpoint, StackMessage
from xgv_cosim.links.base import Link
from xgv_cosim.parameters import VehicleParameters
from xgv_cosim.perception import ModeView
from xgv_cosim.traveller import Traveller
from xgv_cosim.vehicles.base import SafetyDevices, VehicleProfile


class StartKind(StrEnum):
    """How a vehicle passes from the world's driver to the emulated vehicle (``bind.start``)."""

    HANDOVER = "handover"
    """The world's driver keeps both axes until the profile's run state is reached."""
    COLD = "cold"
    """The emulated vehicle governs from power-up on; at standstill only."""


LinkFactory = Callable[[str, JausAddress], Link]
"""Makes the link of a vehicle; its stack speaks under the given address."""


@dataclass(frozen=True, slots=True)
class Binding:
    """How vehicles are bound: one row of a scenario's ``bind`` list, made ready."""

    profile: VehicleProfile
    parameters: VehicleParameters
    coupling: CouplingKind = CouplingKind.AUTO
    start: StartKind = StartKind.HANDOVER
    driver: Driver = Driver.RIDER
    driver_reaction_s: float = 1.0
    partial_mode: int = 0
    """Bit 0 manual steering, bit 1 manual speed (XGV-51)."""
    transmitter: str = ""
    """Name of the wireless stop's transmitter, which vehicles may share; empty: one of its own."""
    new_link: LinkFactory | None = None
    """None: nobody drives the vehicle through its endpoint."""
    from_tick: int = 0
    """Control tick from which on vehicles are bound; one that is there earlier waits for it."""
    until_tick: int | None = None
    """Control tick on which they are given back to the world's driver; None: never."""


Selector = Callable[[Traveller], Binding | None]
"""Says how to bind a vehicle, None: not at all."""


MOST_REFUSALS = 20
"""So many different refusals of one vehicle are told at once ..."""
REFUSAL_PERIOD_S = 10.0
"""... and then one in this time: strangers on a network can cause as many as they like."""


@dataclass(slots=True)
class RefusalBudget:
    """How many refusals of one vehicle may still be told."""

    left: float = MOST_REFUSALS
    counted_s: float = 0.0

    def take(self, now_s: float) -> bool:
        """Return whether one more may be told now."""
        gained = (now_s - self.counted_s) / REFUSAL_PERIOD_S
        self.left, self.counted_s = min(float(MOST_REFUSALS), self.left + gained), now_s
        if self.left < 1.0:
            return False
        self.left -= 1.0
        return True


@dataclass(slots=True)
class BoundVehicle:
    """The objects of one bound vehicle; its numbers live in ``Fleet``."""

    traveller: Traveller
    slot: int
    binding: Binding
    endpoint: Endpoint
    devices: SafetyDevices
    link: Link | None
    on_the_way: deque[tuple[int, JausAddress, StackMessage]] = field(default_factory=deque)
    """(control tick on which it acts, sender, message) of messages that have arrived and do not act yet."""
    refusals: set[tuple[str, str]] = field(default_factory=set)
    """(message type, reason) of refusals in the journal since the last accepted command of that type:
    repeats at every step are told once."""
    refusal_budget: RefusalBudget = field(default_factory=RefusalBudget)
    raised: frozenset[int] = frozenset()
    """Errors of devices and injections that the endpoint knows of."""
    frozen_since_s: float = 0.0
    """When the controller froze, while it is frozen."""
    lasting: dict[tuple[str, str], float] = field(default_factory=dict)
    """Since when what lasts without effect does: (kind, what) -> simulation time (XGV-41, XGV-68)."""
    drags: bool = False
    """Its endpoint knows that the computer drives against the set parking brake."""
    last_view: ModeView | None = None
    """What the vehicle reported last; a silent controller reports nothing new."""
    is_viewed: bool = False
    """Nothing that ``last_view`` tells has changed since."""

    @property
    def vehicle_id(self) -> str:
        """Return its id in the world."""
        return self.traveller.vehicle_id

    @property
    def is_computing(self) -> bool:
        """Return whether the controller is booted and not frozen (XGV-01, XGV-67)."""
        return self.devices.is_active and not self.devices.is_frozen
