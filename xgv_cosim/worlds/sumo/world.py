"""SUMO as the world: libsumo in this process, some of its vehicles bound to emulated ones."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from xgv_cosim.errors import WorldError
from xgv_cosim.worlds.contacts import Contacts
from xgv_cosim.worlds.levels import Levels
from xgv_cosim.worlds.sumo.asking import Asking
from xgv_cosim.worlds.sumo.bindings import Bindings
from xgv_cosim.worlds.sumo.colours import Colours
from xgv_cosim.worlds.sumo.ghosts import GHOST_PREFIX
from xgv_cosim.worlds.sumo.reader import SnapshotReader
from xgv_cosim.worlds.sumo.road import SumoRoad
from xgv_cosim.worlds.sumo.session import Session
from xgv_cosim.worlds.sumo.stops import Stops
from xgv_cosim.worlds.sumo.surroundings import SurroundingsReader
from xgv_cosim.worlds.sumo.turns import Turns
from xgv_cosim.worlds.sumo.window import Window
from xgv_cosim.worlds.sumo.written import nothing_written

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from xgv_cosim.actuation import CouplingKind
    from xgv_cosim.snapshot import Snapshot
    from xgv_cosim.surroundings import Surroundings
    from xgv_cosim.worlds.base import Placement
    from xgv_cosim.worlds.sumo.engine import OpenSimulation
    from xgv_cosim.worlds.sumo.lazy_snapshot import LazySnapshot


class SumoWorld(Asking):
    """SUMO traffic. Implements ``World``; can be started again after ``close``.

    Args:
        open_simulation: Opens the simulation, or takes hold of one that is open.
        step_s: Step length; SUMO counts whole milliseconds.
        with_ghosts: Let SUMO's drivers see bodies in every lane that they reach into, see ``ghosts``.
    """

    def __init__(
        self, open_simulation: Callable[[], OpenSimulation], step_s: float, *, with_ghosts: bool = True
    ) -> None:
        self._open_simulation = open_simulation
        self._step_s = step_s
        self._with_ghosts = with_ghosts
        self._session: OpenSimulation | None = None
        self._messages: tuple[str, ...] = ()
        self._surroundings: SurroundingsReader | None = None
        self._last: LazySnapshot | None = None
        """The last snapshot of an open world."""

    @classmethod
    def headless(
        cls,
        config_file: Path,
        *,
        step_s: float,
        seed: int,
        options: tuple[str, ...] = (),
        with_ghosts: bool = True,
    ) -> SumoWorld:
        """Return a world that runs in this process, without a window.

        Args:
            config_file: SUMO configuration (``.sumocfg``).
            step_s: Step length; SUMO counts whole milliseconds.
            seed: Seed of SUMO's random numbers; the same seed gives the same traffic, bit by bit.
            options: Further SUMO command-line options; they win over those chosen here. Relative names of
                input files lie below the folder of the configuration.
            with_ghosts: See the class.
        """
        opener = partial(Session, config_file, step_s=step_s, seed=seed, options=options)
        return cls(opener, step_s, with_ghosts=with_ghosts)

    @classmethod
    def windowed(
        cls,
        config_file: Path,
        *,
        step_s: float,
        seed: int,
        options: tuple[str, ...] = (),
        delay_ms: float | None = None,
    ) -> SumoWorld:
        """Return a world in a window of sumo-gui, in a process of its own.

        Args:
            config_file: See ``headless``; so the next three.
            step_s: See ``headless``.
            seed: See ``headless``.
            options: See ``headless``.
            delay_ms: Wall time of each step at least; None: as long as it simulates.
        """
        delay = 1000.0 * step_s if delay_ms is None else delay_ms
        opens = partial(Window, config_file, step_s=step_s, seed=seed, options=options, delay_ms=delay)
        return cls(opens, step_s)

    @property
    def road(self) -> SumoRoad:
        """Return the lanes.

        Raises:
            WorldError: The world has not been started.
        """
        self._open()
        return self._road

    @property
    def is_open(self) -> bool:
        """Return whether the world is started and neither closed nor failed."""
        return self._session is not None and self._session.is_open

    @property
    def messages(self) -> tuple[str, ...]:
        """Return SUMO's own warnings and errors so far, oldest first; kept after ``close``.

        Without what it says of ghosts: they are ours, and what they touch is for the contacts to tell.
        """
        messages = self._session.messages if self._session is not None else self._messages
        return tuple(line for line in messages if GHOST_PREFIX not in line)

    def start(self) -> Snapshot:
        """Open the simulation; SUMO inserts the first vehicles in the first step, so there is none yet.

        Raises:
            WorldError: A simulation is open in this process, or SUMO refuses its configuration.
            MissingLibraryError: libsumo cannot be loaded.
        """
        if self.is_open:
            raise WorldError("this world is started already; close it first")
        session = self._session = self._open_simulation()
        with session.failures():
            self._road = SumoRoad.read(session.engine)
            self._bindings = Bindings(session.engine, self._road, self._step_s, with_ghosts=self._with_ghosts)
            vehicle = session.engine.vehicle
            road = self._road
            levels = Levels(
                road.shapes, lambda name: float(vehicle.getPosition3D(name)[2]), road.onward, road.junctions
            )
            self._contacts = Contacts(self._road.lane_ids, self._road.junctions, self._road, levels)
            self._colours = Colours(session.engine)
            self._stops = Stops(session.engine)
            self._turns = Turns(road)
            self._reader = SnapshotReader(
                session, self._road, self._step_s, self._bindings.bound, self._bindings.integration
            )
            self._snapshot = self._last = self._reader.read(nothing_written(), None, self._bindings.headings)
        self._surroundings = None
        return self._snapshot

    def unpark(self, vehicle_id: str) -> bool:
        """Have a parked vehicle drive off without its stops; return whether it is parked no longer.

        SUMO's driver brings it onto its lane when there is a gap.

        Raises:
            WorldError: SUMO has no such vehicle now, or the world is closed.
        """
        session = self._open()
        row = self._snapshot.index_of.get(vehicle_id)
        if row is None:
            raise WorldError(f"SUMO has no vehicle {vehicle_id!r} at {self._snapshot.time_s} s")
        with session.failures():
            self._snapshot.keep(row)  # without its stop SUMO has it nowhere, until it is back on its lane
            return self._stops.unpark(vehicle_id, on_lane=self._snapshot.value("lane", row) >= 0)

    def bind(self, vehicle_id: str, coupling: CouplingKind) -> None:
        """Take a vehicle of SUMO into the placement from the next step on; its stops are gone for good.

        One that is parked loses them when it moves.

        Raises:
            WorldError: SUMO has no such vehicle now, or it is bound already.
        """
        session = self._open()
        if vehicle_id in self._bindings.bound:
            raise WorldError(f"vehicle {vehicle_id!r} is bound already; release it first")
        if vehicle_id not in self._snapshot.index_of:
            raise WorldError(f"SUMO has no vehicle {vehicle_id!r} at {self._snapshot.time_s} s")
        with session.failures():
            row = self._snapshot.index_of[vehicle_id]
            self._stops.bind(vehicle_id, on_lane=self._snapshot.value("lane", row) >= 0)
        self._bindings.add(vehicle_id, coupling)

    def release(self, vehicle_id: str) -> None:
        """Give a bound vehicle back to SUMO's driver for good; one that has left SUMO needs no release.

        Raises:
            WorldError: The vehicle drives in SUMO but is not bound.
        """
        session = self._open()
        here = vehicle_id in self._snapshot.index_of
        if vehicle_id not in self._bindings.bound and here:
            raise WorldError(f"vehicle {vehicle_id!r} is not bound")
        with session.failures():
            if here or vehicle_id in session.engine.vehicle.getTeleportingIDList():
                self._bindings.give_back(vehicle_id, self._snapshot)
                self._stops.give_back(vehicle_id)
            else:
                self._bindings.forget(vehicle_id)

    def set_coupling(self, vehicle_id: str, coupling: CouplingKind) -> None:
        """Choose how a bound vehicle is written into SUMO from the next step on.

        Raises:
            WorldError: The vehicle is not bound.
        """
        self._open()
        if vehicle_id not in self._bindings.bound:
            raise WorldError(f"vehicle {vehicle_id!r} is not bound")
        self._bindings.bound.set_kind(vehicle_id, coupling)

    def immobilise(self, vehicle_id: str) -> None:
        """Hold a vehicle that is not bound where it is now, for good or until it is bound.

        Raises:
            WorldError: SUMO has no such vehicle now, or it is bound.
        """
        session = self._open()
        if vehicle_id in self._bindings.bound:
            raise WorldError(f"vehicle {vehicle_id!r} is bound: it is held by placing it")
        row = self._snapshot.index_of.get(vehicle_id)
        if row is None:
            raise WorldError(f"SUMO has no vehicle {vehicle_id!r} at {self._snapshot.time_s} s")
        with session.failures():
            self._bindings.hold(vehicle_id, self._snapshot, row)

    def step(self, placement: Placement) -> Snapshot:
        """Advance SUMO by one step with the bound vehicles where ``placement`` says.

        Vehicles that arrived are no longer bound afterwards.

        Raises:
            WorldError: A vehicle of the placement is not bound, or SUMO failed and is closed now.
        """
        session, before = self._open(), self._snapshot
        with session.failures():
            self._stops.drop_moved(placement, before)
            self._bindings.write(placement, before)
        before.close()
        session.step()
        with session.failures():
            self._bindings.after_step()
            snapshot = self._reader.read(
                self._bindings.written,
                before,
                self._bindings.headings,
                self._bindings.take_notes(),
                self._bindings.ghosts.owner_of,
            )
            self._snapshot = self._last = snapshot
            subjects = self._reader.rows_of_bound(snapshot.cast)
            snapshot.with_collisions(self._contacts.merged(snapshot, self._bindings.bound, subjects))
        for vehicle_id in snapshot.arrived:
            self._forget(vehicle_id)
        return snapshot

    def surroundings(self, vehicle_ids: Sequence[str]) -> Surroundings:
        """Return what surrounds vehicles of the last snapshot.

        Raises:
            WorldError: The world is closed, or SUMO failed and is closed now.
        """
        session = self._open()
        with session.failures():
            if self._surroundings is None:  # the network's links are read once, if there is a stack at all
                self._surroundings = SurroundingsReader.of(session.engine, self._road)
            return self._surroundings.read(self._snapshot, vehicle_ids)

    def paint(self, vehicle_id: str, rgb: tuple[int, int, int] | None) -> None:
        """Give a vehicle of SUMO a colour in its window, or with None its own again; does nothing else.

        Args:
            vehicle_id: A vehicle that SUMO has now.
            rgb: Red, green and blue, each 0 to 255.

        Raises:
            WorldError: SUMO has no such vehicle, or the world is closed.
        """
        session = self._open()
        with session.failures():
            self._colours.paint(vehicle_id, rgb)

    def keep(self, vehicle_id: str) -> None:
        """Read what the last snapshot has of a vehicle that somebody else may take out of SUMO now."""
        row = self._snapshot.index_of.get(vehicle_id)
        if row is not None and self.is_open:
            with self._open().failures():
                self._snapshot.keep(row)

    def lose(self, vehicle_id: str) -> None:
        """Forget a vehicle, bound or not, that somebody else has taken out of SUMO.

        What was kept of it in the last snapshot stays readable; its id is free for another vehicle.
        """
        if not self.is_open:
            return
        self._snapshot.lose(vehicle_id)
        self._reader.lose(vehicle_id)
        self._forget(vehicle_id)

    @property
    def is_handing_over(self) -> bool:
        """Return whether a hand-over to SUMO's driver has not ended."""
        return self._bindings.is_handing_over

    def part(self, *, at_once: bool = False) -> None:
        """Take back what is in SUMO of us, when nobody is bound any more.

        Args:
            at_once: Also what eases hand-overs; else the next steps see to that, or ``close``.

        Raises:
            WorldError: The world is closed.
        """
        session = self._open()
        with session.failures():
            if at_once:
                self._bindings.settle()
            else:
                self._bindings.part()

    def bring_back(self) -> None:
        """Have cars that wait off the road for the next step on it then: SUMO makes it without us.

        Raises:
            WorldError: The world is closed.
        """
        session = self._open()
        with session.failures():
            self._bindings.bring_back()

    def close(self) -> None:
        """End the simulation, whose last snapshot stays readable; does nothing when it is closed."""
        if self._session is not None:
            if self._last is not None:
                if self._session.is_open:
                    with self._session.failures():
                        self._last.read_all()
                self._last.close()
                self._last = None
            if self._session.is_open and self._session.goes_on:
                with self._session.failures():
                    self._bindings.settle()
            self._session.close()
            self._messages = self._session.messages
            self._session = None

    def _forget(self, vehicle_id: str) -> None:
        """Drop a vehicle that SUMO has no longer: whoever has its id later is another."""
        self._bindings.forget(vehicle_id)
        self._stops.forget(vehicle_id)
        self._colours.forget(vehicle_id)
        if self._surroundings is not None:
            self._surroundings.forget(vehicle_id)

    def _open(self) -> OpenSimulation:
        if self._session is None or not self._session.is_open:
            raise WorldError("the world is closed; start it first")
        return self._session
