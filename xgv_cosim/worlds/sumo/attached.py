"""A simulation that a user's script has opened and goes on stepping: the world's side of it."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, NamedTuple

from xgv_cosim.clock import CONTROL_TICK_S
from xgv_cosim.errors import WorldConfigurationError, WorldError
from xgv_cosim.worlds.sumo.engine import OverSocket, errors_of
from xgv_cosim.worlds.sumo.inputs import TRUE
from xgv_cosim.worlds.sumo.times import seconds_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from xgv_cosim.worlds.sumo.engine import Engine
    from xgv_cosim.worlds.sumo.holding import Hold

LONGEST_STEP_S = 0.3
"""A stack's command lives 0.4 s: with longer steps it would die between two of them."""


class WantedOption(NamedTuple):
    """A SUMO option that cannot be changed once SUMO runs."""

    name: str
    suits: Callable[[str], bool]
    otherwise: str
    """What happens under another value."""
    remedy: str


WANTED_OPTIONS = (
    WantedOption(
        "collision.action",
        lambda value: value == "warn",
        "SUMO hides the collisions of bound vehicles, or takes vehicles away",
        "warn",
    ),
    WantedOption(
        "collision.mingap-factor",
        lambda value: float(value) == 0.0,
        "SUMO takes gaps below a type's minGap for collisions",
        "0",
    ),
    WantedOption(
        "collision.check-junctions",
        lambda value: value.lower() in TRUE,
        "SUMO reports no collision inside junctions",
        "true",
    ),
    WantedOption(
        "time-to-teleport",
        lambda value: seconds_of(value) <= 0.0,
        "SUMO takes vehicles away that have stood for long, stopped ones and those behind them",
        "-1",
    ),
    WantedOption(
        "lanechange.duration",
        lambda value: seconds_of(value) > 0.0,
        "a car that SUMO's driver steers jumps into the next lane within one step",
        "3",
    ),
)
"""What a headless run sets."""


def step_length_s(engine: Engine) -> float:
    """Return SUMO's step length.

    Raises:
        WorldConfigurationError: No vehicle can be bound with it, or SUMO runs a model that is not supported.
    """
    step_s = float(engine.simulation.getDeltaT())
    ticks = step_s / CONTROL_TICK_S
    if abs(ticks - round(ticks)) > 1e-6 or not 1 <= round(ticks) <= round(LONGEST_STEP_S / CONTROL_TICK_S):
        raise WorldConfigurationError(
            f"SUMO's step is {step_s:g} s, expected a whole multiple of {CONTROL_TICK_S:g} s up to "
            f"{LONGEST_STEP_S:g} s; start SUMO with --step-length 0.1"
        )
    if engine.simulation.getOption("mesosim").lower() in TRUE:
        raise WorldConfigurationError(
            "SUMO runs the mesoscopic model, in which no vehicle can be placed; start it without --mesosim"
        )
    if float(engine.simulation.getOption("lateral-resolution")) > 0.0:
        raise WorldConfigurationError(
            "SUMO runs the sublane model, which is not supported; start it without --lateral-resolution"
        )
    return round(step_s, 3)


def unsuitable_options(engine: Engine) -> tuple[str, ...]:
    """Return a sentence for each option that differs from what a headless run sets."""
    got = {wanted: str(engine.simulation.getOption(wanted.name)) for wanted in WANTED_OPTIONS}
    return tuple(
        f"SUMO option --{wanted.name} is {value}: {wanted.otherwise}; start SUMO with "
        f"--{wanted.name} {wanted.remedy}"
        for wanted, value in got.items()
        if not wanted.suits(value)
    )


def seed_of(engine: Engine) -> int:
    """Return the seed that SUMO was started with."""
    return int(engine.simulation.getOption("seed"))


class AttachedSimulation:
    """The user's simulation from now on. Implements ``OpenSimulation``.

    Args:
        hold: The script's hold on SUMO, with a simulation open.

    Raises:
        WorldError: There is no simulation.
    """

    def __init__(self, hold: Hold) -> None:
        engine = hold.engine
        if engine is None:
            raise WorldError("the script has no simulation open; start SUMO first")
        self.engine: Engine = engine
        self.begin_s = float(engine.simulation.getTime())
        self._is_closed = False
        self.messages = unsuitable_options(engine)
        self._hold = hold
        self._errors = errors_of(engine)
        self._over_socket = engine if isinstance(engine, OverSocket) else None
        if self._over_socket:
            self._over_socket.remember()

    @property
    def is_open(self) -> bool:
        """Return whether the script's simulation goes on, as far as the plugin knows."""
        return not self._is_closed and self._hold.engine is not None

    @property
    def goes_on(self) -> bool:
        """Return that SUMO runs on after ``close``."""
        return True

    def step(self) -> None:
        """Advance SUMO by one step; what SUMO raises in it is raised as it is, for the script to see."""
        if self._over_socket:
            with self.failures():
                self._over_socket.send()
        self._hold.step_once()
        if self._over_socket:
            with self.failures():
                self._over_socket.look_ahead()

    @contextmanager
    def failures(self) -> Iterator[None]:
        """Make SUMO's errors the errors of a world.

        Raises:
            WorldError: SUMO refused what the plugin asked of it. That SUMO is gone is told by its own error.
        """
        try:
            yield
        except self._errors as error:
            self._is_closed = True
            if self._hold.engine is None:
                raise
            raise WorldError(f"SUMO failed under the attached plugin: {error}") from error

    def close(self) -> None:
        """Let go of it; it stays the script's to end."""
        self._is_closed = True
