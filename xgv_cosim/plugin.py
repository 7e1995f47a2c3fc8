"""Bound vehicles in a script's own SUMO simulation: what ``attach`` returns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from xgv_cosim.errors import ScenarioError, UnknownVehicleError, WorldError
from xgv_cosim.events import Event
from xgv_cosim.observation import Stack
from xgv_cosim.recording import Recorder
from xgv_cosim.scenario.script_rows import bind_row, injection_row
from xgv_cosim.scenario.script_rules import ScriptRules, StackMaker
from xgv_cosim.script_warnings import ScriptWarnings, SumoOptionsWarning
from xgv_cosim.simulation import Binding, Observer, Simulation, VehicleHandle, lifecycle, triggers
from xgv_cosim.simulation.painting import ModePainter
from xgv_cosim.snapshot import Snapshot
from xgv_cosim.traveller import Traveller
from xgv_cosim.worlds.sumo.attached import AttachedSimulation, seed_of, step_length_s
from xgv_cosim.worlds.sumo.attaching import hold_of
from xgv_cosim.worlds.sumo.parting import Parting
from xgv_cosim.worlds.sumo.world import SumoWorld


class Plugin:
    """What ``attach`` returns: bound vehicles in the script's simulation.

    When the script closes SUMO and starts it again, or loads another simulation or state, everything
    begins anew under the same rows of ``bind`` and ``inject``.
    """

    def __init__(
        self,
        traci_or_libsumo: object,
        rules: ScriptRules,
        seed: int | None,
        observers: Sequence[Observer],
        *,
        colours: bool = False,
    ) -> None:
        self._rules = rules
        self._seed = seed
        self._observers = tuple(observers)
        self._colours = colours
        self._released: set[str] = set()
        self._asks_for_present = False
        """A row of ``bind`` is new, so that vehicles may be meant that drive already."""
        self._recorder: Recorder | None = None
        self._simulation: Simulation | None = None
        self._world: SumoWorld
        """That of the simulation."""
        self._parting: Parting | None = None
        """Set once this plugin is detached, as long as a hand-over to SUMO's driver is under way."""
        self._begin_s = 0.0
        self._events: list[Event] = []
        self._warnings = ScriptWarnings()
        self._hold = hold_of(traci_or_libsumo, self)
        try:
            if self._hold.engine is not None:
                step_length_s(self._hold.engine)
        except BaseException:
            self._hold.let_go()
            raise

    def bind(
        self,
        vehicles: str | Sequence[str] | None = None,
        *,
        type: str | None = None,  # noqa: A002 - the key of a scenario
        share: float | None = None,
        seed: int | None = None,
        stack: str | Stack | StackMaker = "reference",
        **row: Any,  # noqa: ANN401 - checked as the row of a scenario
    ) -> None:
        """Bind vehicles: those that drive already from the next step on, the others as they depart.

        For a vehicle that several calls mean, the first one counts, as in a scenario; after ``release`` it is
        the one that names it again.

        Args:
            vehicles: An id or pattern (``xgv_*``), or several of them.
            type: Instead: SUMO's vehicle type, or a pattern.
            share: Instead, or of that type: share of the vehicles, each drawn by its id and ``seed``.
            seed: Seed of the draw.
            stack: Name of a stack as in a scenario, an object with ``act(observation)`` for one vehicle, or
                a class or function that makes such objects from ``vehicle_id`` and ``address``, each if it
                takes it.
            **row: Further keys of a row of a scenario's ``bind``, for example ``driver="none"``.

        Raises:
            ScenarioError: A key is unknown or a value wrong, or it is not clear which vehicles are meant.
        """
        query = {"type": type, "share": share, "seed": seed}
        name = stack if isinstance(stack, str) else "none"
        again = self._released & ({vehicles} if isinstance(vehicles, str) else set(vehicles or ()))
        self._rules.bind(bind_row(vehicles, query, {"stack": name, **row}), stack, again)
        self._released -= again
        self._asks_for_present = True

    def inject(
        self,
        vehicles: str | Sequence[str] | None = None,
        *,
        type: str | None = None,  # noqa: A002 - the key of a scenario
        share: float | None = None,
        seed: int | None = None,
        **row: Any,  # noqa: ANN401 - checked as the row of a scenario
    ) -> None:
        """Let something happen to bound vehicles, as a row of a scenario's ``injections`` does.

        Args:
            vehicles: An id or pattern, or several of them.
            type: As in ``bind``.
            share: As in ``bind``.
            seed: As in ``bind``.
            **row: ``kind``, ``at_s`` (see ``now_s``) and further keys of the row.

        Raises:
            ScenarioError: A key is unknown or a value wrong, or the time is past.
        """
        section = injection_row(vehicles, {"type": type, "share": share, "seed": seed}, row)
        if self._simulation is not None and section.begin_s < self.now_s and section.when is None:
            raise ScenarioError(
                f"inject: at_s {section.begin_s:g} is past, it is {self.now_s:g} s; give a later time, or "
                "use vehicle(id).inject(kind), which acts with the next step"
            )
        injection = self._rules.inject(section)
        if self._simulation is not None:
            triggers.schedule(self._simulation.state, injection)

    def release(self, vehicle_id: str) -> None:
        """Give a bound vehicle back to SUMO's driver; it stays SUMO's until ``bind`` names it again.

        Raises:
            UnknownVehicleError: No such vehicle is bound now.
        """
        if self._simulation is None:
            raise UnknownVehicleError(vehicle_id, ())
        self._simulation.release(vehicle_id)
        self._hold.settle()
        self._released.add(vehicle_id)

    @property
    def now_s(self) -> float:
        """Simulation time: 0 at SUMO's time ``begin_s``."""
        return 0.0 if self._simulation is None else self._simulation.now_s

    @property
    def begin_s(self) -> float:
        """SUMO's time when the plugin took hold of the simulation: its begin, if attached by then."""
        return self._begin_s

    @property
    def vehicle_ids(self) -> tuple[str, ...]:
        """Ids of the vehicles bound now."""
        return () if self._simulation is None else self._simulation.vehicle_ids

    @property
    def snapshot(self) -> Snapshot:
        """All vehicles of SUMO after the last step.

        Raises:
            WorldError: There is no simulation.
        """
        return self._opened().snapshot

    @property
    def ended_by(self) -> str:
        """What has ended the run under ``contact="end"``, empty while nothing has."""
        return "" if self._simulation is None else self._simulation.ended_by

    @property
    def events(self) -> tuple[Event, ...]:
        """What has happened in this simulation, or in the last one if there is none now."""
        return tuple(self._events)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Options of SUMO that hide something from the plugin, with what to start SUMO with instead."""
        return () if self._simulation is None else self._simulation.world.messages

    def vehicle(self, vehicle_id: str) -> VehicleHandle:
        """Return the handle of a bound vehicle.

        Raises:
            UnknownVehicleError: No such vehicle is bound now.
            WorldError: There is no simulation.
        """
        return self._opened().vehicle(vehicle_id)

    def record(self, folder: str | Path) -> None:
        """Record the simulation that begins next into a run folder; call it before its first step.

        Raises:
            ScenarioError: A simulation is under way, or another folder waits already.
            RecordingError: The folder is not empty or cannot be written.
        """
        if self._simulation is not None or self._recorder is not None:
            raise ScenarioError("record: call it once for each simulation, before its first step")
        self._recorder = Recorder(Path(folder), safety_mode_name=self._rules.safety_mode_name)

    def detach(self) -> None:
        """Give all vehicles back to SUMO's driver and let go of the script, which can go on.

        Cars beside the centre of their lane, or faster than their driver wants, are eased there by the
        script's next steps; after the last of them nothing is left of the plugin.
        """
        self._detach(quietly=False)

    def _detach(self, *, quietly: bool) -> None:
        if self._parting is not None:
            return
        try:
            engine = self._hold.engine
            if self._simulation is not None and engine is not None:
                present = frozenset(engine.vehicle.getIDList())  # after a failed step some may have gone
                for vehicle_id in [name for name in self.vehicle_ids if name in present]:
                    self._simulation.world.release(vehicle_id)
            try:
                self._end("the plugin was detached", quietly=quietly, goes_on=True)
            finally:
                if self._hold.engine is not None:
                    self._hold.settle()  # after the world has taken back what is its own
        finally:
            if self._parting is None:
                self._hold.let_go()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._detach(quietly=error is not None)

    def user_steps(self) -> None:
        """Make SUMO's next step, which the script asks for."""
        if self._parting is not None:
            self._parting.step()
            return
        simulation = self._opened()
        if simulation.is_over:
            raise WorldError(
                "an earlier step of the plugin failed; detach() it, or close SUMO and start it again"
            )
        if self._asks_for_present:
            self._asks_for_present = False
            self._bind_present(simulation)
        snapshot = simulation.step()
        if abs(snapshot.time_s - simulation.now_s) > 1e-6:
            raise WorldError(
                f"SUMO is at {self._begin_s + snapshot.time_s:g} s, but the steps that the plugin saw lead "
                f"to {self._begin_s + simulation.now_s:g} s: the script has stepped or loaded past it. Step "
                "through the module or connection that is attached"
            )

    @contextmanager
    def user_removes(self, vehicle_id: str) -> Iterator[None]:
        """End the binding of a vehicle that the script takes out of SUMO; everything else goes on.

        What SUMO refuses within the context changes nothing.
        """
        has_world = self._simulation is not None or self._parting is not None
        if has_world:
            self._world.keep(vehicle_id)
        yield
        if self._simulation is not None:
            lifecycle.lose(self._simulation.state, vehicle_id, "the script removed it from SUMO")
        if has_world:
            self._world.lose(vehicle_id)

    def user_ends(self) -> None:
        """Forget the simulation that the script ends; what was asked for holds for the next one too."""
        if self._parting is not None:
            self._parting.end(goes_on=False)
        else:
            self._end("the script has ended the simulation", quietly=False)

    def gives_way(self) -> bool:
        """Let go of the script if the plugin is detached but for hand-overs under way; return whether so."""
        if self._parting is not None:
            self._parting.end(goes_on=True)
        return self._parting is not None

    def _end(self, why: str, *, quietly: bool, goes_on: bool = False) -> None:
        simulation, self._simulation = self._simulation, None
        if simulation is None:
            return
        for vehicle_id in [vehicle.vehicle_id for vehicle in simulation.state.vehicles]:
            lifecycle.release(simulation.state, vehicle_id, why)
        if goes_on and self._world.is_open:
            self._parting = Parting.of(self._world, self._hold, at_once=quietly or simulation.is_over)
        if self._parting is None:
            simulation.close()
        self._released.clear()
        if self._recorder is not None:
            self._recorder.close()
            self._recorder = None
        if not quietly:
            self._warnings.give(self._rules.unmatched(), UserWarning)

    def _opened(self) -> Simulation:
        """Return the simulation, made around the script's if there is none yet."""
        if self._simulation is None:
            engine = self._hold.engine if self._parting is None else None
            if engine is None:
                raise WorldError(
                    "there is no simulation to take part in: start SUMO first, or attach() again"
                )
            step_s = step_length_s(engine)
            injections = self._rules.begin(seed_of(engine) if self._seed is None else self._seed)
            world = self._world = SumoWorld(lambda: AttachedSimulation(self._hold), step_s)
            painters = [ModePainter(world.paint, self._rules.safety_mode_name)] if self._colours else []
            simulation = Simulation(
                world,
                self._selected,
                injections,
                step_s=step_s,
                observers=[*self._observers, *painters, *([self._recorder] if self._recorder else [])],
                contact=self._rules.contact,
            )
            self._begin_s = float(engine.simulation.getTime())
            self._events = simulation.state.journal.events
            if self._recorder:
                self._recorder.use_road(simulation.world.road)
            self._simulation = simulation
            self._hold.settle()
            self._warnings.give(simulation.world.messages, SumoOptionsWarning)
        return self._simulation

    def _selected(self, who: Traveller) -> Binding | None:
        return None if who.vehicle_id in self._released else self._rules.select(who)

    def _bind_present(self, simulation: Simulation) -> None:
        """Bind those who drive already and whom a newer row of ``bind`` means."""
        tick = simulation.state.clock.tick
        for vehicle_id in simulation.snapshot.index_of:  # those of the last step whom SUMO still has
            if vehicle_id in simulation.state.vehicles:
                continue
            binding = self._selected(simulation.world.traveller(vehicle_id))
            if binding is None or (binding.until_tick is not None and binding.until_tick <= tick):
                continue
            if binding.from_tick > tick:
                self._asks_for_present = True  # again before the next step
            else:
                simulation.bind_vehicle(vehicle_id, binding)
