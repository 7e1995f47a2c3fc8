"""The shape of a world: the traffic around the bound vehicles, whatever engine moves it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from xgv_cosim.actuation import CouplingKind
from xgv_cosim.columns import BoolColumn, FloatColumn
from xgv_cosim.road import Road
from xgv_cosim.snapshot import Snapshot
from xgv_cosim.surroundings import Surroundings
from xgv_cosim.traveller import Traveller


class Placement(NamedTuple):
    """Where the plant puts each bound vehicle at the end of the step, and which axes are the plant's.

    Every column has shape ``(len(ids),)``. Frame east-north-up, reference point front bumper centre.
    """

    ids: tuple[str, ...]
    front_x_m: FloatColumn
    front_y_m: FloatColumn
    heading_rad: FloatColumn
    """Counter-clockwise from east."""
    speed_mps: FloatColumn
    """Speed at the end of the step, negative in reverse."""
    travelled_m: FloatColumn
    """Signed distance driven during the step."""
    computer_speed: BoolColumn
    """True: the plant governs speed. False: the world's own driver does."""
    computer_steering: BoolColumn
    """True: the plant governs the lateral position. False: the world's own driver does."""


class World(Protocol):
    """A traffic engine with vehicles of its own, some of which are bound to emulated ones."""

    @property
    def road(self) -> Road:
        """Return the lanes; valid after ``start``."""
        ...

    @property
    def messages(self) -> tuple[str, ...]:
        """Return the engine's own warnings so far, oldest first; kept after ``close``."""
        ...

    def knows(self, vehicle_id: str) -> bool:
        """Return whether the vehicle is in the world, or known to come."""
        ...

    def traveller(self, vehicle_id: str) -> Traveller:
        """Return who a vehicle is that is in the world now."""
        ...

    def stops_of(self, vehicle_id: str) -> tuple[str, ...]:
        """Return in words where its demand has a vehicle of the world stop, the next one first."""
        ...

    def tight_turns_of(self, vehicle_id: str, radius_m: float) -> tuple[str, ...]:
        """Return in words where the rest of a vehicle's route turns on a smaller radius than this."""
        ...

    def unpark(self, vehicle_id: str) -> bool:
        """Have a parked vehicle drive off without its stops; return whether it is parked no longer."""
        ...

    def start(self) -> Snapshot:
        """Open the world and return its state before the first step.

        Raises:
            WorldError: The engine cannot start, or is already in use in this process.
        """
        ...

    def bind(self, vehicle_id: str, coupling: CouplingKind) -> None:
        """Take a vehicle of the world into the placement from the next step on; it loses its stops.

        One that is parked loses them when it moves: released before, it is parked as before.
        """
        ...

    def release(self, vehicle_id: str) -> None:
        """Give a bound vehicle back to the world's own driver for good."""
        ...

    def set_coupling(self, vehicle_id: str, coupling: CouplingKind) -> None:
        """Choose how a bound vehicle is written into the world from the next step on."""
        ...

    def immobilise(self, vehicle_id: str) -> None:
        """Hold a vehicle that is not bound where it is now, for good or until it is bound."""
        ...

    def step(self, placement: Placement) -> Snapshot:
        """Advance the world by one step with the bound vehicles where ``placement`` says.

        Columns of the snapshot may be read only when they are asked for; what nobody has asked for by the
        next step is gone, unless ``Snapshot.read_all`` was called.

        Raises:
            WorldError: The engine failed; the world is closed.
        """
        ...

    def surroundings(self, vehicle_ids: Sequence[str]) -> Surroundings:
        """Return what surrounds vehicles of the last snapshot; whoever is not asked for costs nothing.

        A world that knows no routes, neighbours or signals answers with ``plain_surroundings``.
        """
        ...

    def close(self) -> None:
        """End the engine's simulation; does nothing when it is closed."""
        ...
