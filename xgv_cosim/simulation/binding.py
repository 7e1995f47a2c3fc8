"""How a vehicle of the world is bound, and the objects one bound vehicle owns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum

from jaus.address import JausAddress
from xgv_cosim.actuation import CouplingKind, Driver
from xgv_cosim.endpoint import Endpoint
from xgv_cosim.links.base import Link
from xgv_cosim.parameters import VehicleParameters
from xgv_cosim.vehicles.base import VehicleProfile


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
    coupling: CouplingKind = CouplingKind.FREE
    start: StartKind = StartKind.HANDOVER
    driver: Driver = Driver.RIDER
    driver_reaction_s: float = 1.0
    partial_mode: int = 0
    """Bit 0 manual steering, bit 1 manual speed (XGV-51)."""
    new_link: LinkFactory | None = None
    """None: nobody drives the vehicle through its endpoint."""


Selector = Callable[[str, str], Binding | None]
"""(vehicle id, type id) -> how to bind it, None: not at all."""


@dataclass(slots=True)
class BoundVehicle:
    """The objects of one bound vehicle; its numbers live in ``Fleet``."""

    vehicle_id: str
    type_id: str
    """The world's vehicle type."""
    slot: int
    binding: Binding
    endpoint: Endpoint
    link: Link | None
    refusals: set[tuple[str, str]] = field(default_factory=set)
    """(message type, reason) of refusals in the journal since the last accepted command: repeats at
    every step are told once."""
    link_blocked: bool = False
    """True while an injection swallows what the stack sends."""
