"""Everything a run has besides its world: the fleet, the clock, the objects, what acts on them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from jaus.address import JausAddress
from xgv_cosim.actuation import CouplingKind
from xgv_cosim.clock import Clock
from xgv_cosim.columns import BoolColumn, IntColumn, WordMatrix
from xgv_cosim.endpoint import StackMessage
from xgv_cosim.errors import UnknownVehicleError
from xgv_cosim.fleet import Fleet
from xgv_cosim.injection import InjectionKind, OperatorAction
from xgv_cosim.simulation.alarms import Alarms
from xgv_cosim.simulation.binding import Binding, BoundVehicle
from xgv_cosim.simulation.bound import BoundVehicles
from xgv_cosim.simulation.devices import Devices, Edge
from xgv_cosim.simulation.journal import Journal
from xgv_cosim.simulation.waiting import Waiting
from xgv_cosim.vehicles.transmitter import Transmitter


@dataclass(slots=True)
class RunState:
    """Shared by the functions of this package; nobody else writes into it."""

    clock: Clock
    journal: Journal
    devices: Devices
    fleet: Fleet = field(default_factory=Fleet)
    vehicles: BoundVehicles = field(default_factory=BoundVehicles)
    alarms: Alarms = field(default_factory=Alarms)
    rows: IntColumn = field(default_factory=lambda: np.empty(0, np.int64))
    """Row of each bound vehicle in the last snapshot, in slot order; -1: it is not there."""
    seen: WordMatrix = field(default_factory=lambda: np.zeros((2, 0), np.int64))
    """The inputs of the modes when they were last resolved, see ``kernel.watching``."""
    viewed: WordMatrix = field(default_factory=lambda: np.zeros((2, 0), np.int64))
    """Likewise when the stacks were last told of their modes."""
    told: IntColumn = field(default_factory=lambda: np.zeros(0, np.int64))
    """What ``reporting.note_stops_without_effect`` last saw of each slot, in bits."""
    dragging: BoolColumn = field(default_factory=lambda: np.zeros(0, np.bool_))
    """Which slots it last saw driving against the set parking brake."""
    transmitters: dict[str, Transmitter] = field(default_factory=dict)
    """Transmitters that several vehicles share, by name."""
    waiting: Waiting = field(default_factory=Waiting)
    expected: dict[str, Binding] = field(default_factory=dict)
    """Vehicles of the world whose binding begins later."""
    released: set[str] = field(default_factory=set)
    """Vehicles that were bound once and are no longer."""
    contacts: set[tuple[str, str]] = field(default_factory=set)
    """(collider, victim) of the contacts that lasted at the end of the last step."""
    waiting_shifts: dict[str, tuple[int, float]] = field(default_factory=dict)
    """By vehicle: the ``actuation.Gear`` that waits to be engaged, and since when (XGV-70)."""
    without_drive: dict[str, float] = field(default_factory=dict)
    """By vehicle: since when the computer is to drive it with the engine off (XGV-31)."""
    limited_by_grip: dict[str, float] = field(default_factory=dict)
    """By vehicle: since when the tyres have given less curvature than the wheel asks for."""
    crashed: set[str] = field(default_factory=set)
    """Vehicles that stay where they are after a contact, bound or not."""
    ended_by: str = ""
    """What ended the run early, empty while nothing has."""
    off_road: set[str] = field(default_factory=set)
    """Bound vehicles that were off the road at the end of the last step."""
    requested: list[Edge] = field(default_factory=list)
    """Operators' requests, applied at the start of the next step."""
    partial_requested: list[tuple[str, int]] = field(default_factory=list)
    """(vehicle id, partial mode bits), applied likewise."""
    couplings_requested: list[tuple[str, CouplingKind]] = field(default_factory=list)
    """(vehicle id, how it is to be written into the world), applied likewise."""
    posted: list[tuple[str, JausAddress, StackMessage]] = field(default_factory=list)
    """(vehicle id, sender, message) sent from Python, delivered at the start of the next step."""
    errors_to_clear: list[str] = field(default_factory=list)
    """Vehicles whose latched errors the operator clears, likewise."""

    operated: list[tuple[str, OperatorAction]] = field(default_factory=list)
    """(vehicle id, what its operator does there), applied likewise."""

    @property
    def now_s(self) -> float:
        """Simulation time."""
        return self.clock.now_s

    def vehicle(self, vehicle_id: str) -> BoundVehicle:
        """Return a bound vehicle's objects.

        Raises:
            UnknownVehicleError: No such vehicle is bound now.
        """
        if vehicle_id not in self.vehicles:
            raise UnknownVehicleError(vehicle_id, self.fleet.bound_ids)
        return self.vehicles[vehicle_id]

    def transmitter(self, name: str) -> Transmitter | None:
        """Return a shared transmitter, made when it is first asked for; None without a name."""
        return self.transmitters.setdefault(name, Transmitter()) if name else None

    def request(
        self, vehicle_id: str, kind: InjectionKind, code: int | None = None, *, begins: bool = True
    ) -> None:
        """Ask for something to begin or end acting on a vehicle at the start of the next step."""
        self.requested.append(Edge(self.vehicle(vehicle_id).vehicle_id, kind, code, begins))

    def note(
        self, vehicle: str, kind: str, before: str = "", after: str = "", reasons: tuple[str, ...] = ()
    ) -> None:
        """Enter an event at the present tick."""
        self.journal.note(self.now_s, vehicle, kind, before, after, reasons)
