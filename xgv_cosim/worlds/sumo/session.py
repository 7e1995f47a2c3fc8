"""One libsumo simulation: opened with its messages kept, refused while another is open, closed for good.

libsumo holds one simulation per process, and a second ``start`` silently discards the first. SUMO tells
what is wrong on file descriptor 2 rather than in its exceptions, and crashes on some files that are not
well-formed XML; so the inputs are checked first, and the descriptor is caught while it starts.
"""

from __future__ import annotations

import os
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from xgv_cosim.errors import WorldConfigurationError, WorldError
from xgv_cosim.worlds.sumo.holding import LibsumoHold
from xgv_cosim.worlds.sumo.inputs import check_inputs
from xgv_cosim.worlds.sumo.libraries import load_libsumo
from xgv_cosim.worlds.sumo.options import Option, parse_options, with_rooted_files

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import ModuleType
    from typing import IO

QUIET = {
    "no-step-log": "true",
    "duration-log.disable": "true",
    "no-warnings": "true",
    "verbose": "false",
}
"""Nothing lands on stdout or stderr; warnings go into the error log all the same."""
SAFETY = {
    "collision.action": "warn",  # any other action hides collisions of vehicles placed from outside
    "collision.mingap-factor": "0",
    "collision.check-junctions": "true",
    "time-to-teleport": "-1",
    "lanechange.duration": "3",  # else a car that SUMO's driver has jumps a whole lane in one step
}
"""Collisions are recorded, nobody is beamed out of a jam, and nobody jumps into the next lane."""


@contextmanager
def _stderr_kept(kept: IO[bytes]) -> Iterator[None]:
    """Let file descriptor 2 write into ``kept`` meanwhile."""
    sys.stderr.flush()
    saved = os.dup(2)
    os.dup2(kept.fileno(), 2)
    try:
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)


def arguments(
    config_file: Path, step_s: float, seed: int, options: tuple[str, ...], error_log: Path
) -> list[str]:
    """Return what SUMO is started with; see :class:`Session`.

    Raises:
        WorldConfigurationError: ``options`` holds one that is for the scenario to say.
    """
    fixed = {
        "configuration-file": str(config_file),
        "step-length": str(step_s),
        "seed": str(seed),
        "random": "false",  # else the configuration could ask for a seed from the clock
        "error-log": str(error_log),
    }
    given = [with_rooted_files(option, config_file.parent) for option in parse_options(options)]
    chosen = fixed | QUIET | SAFETY
    for option in given:
        chosen.pop(option.name, None)  # SUMO refuses an option that is given twice
    own = [Option(name, value) for name, value in chosen.items()]
    return [option.argument for option in (*own, *given)]


def sentence(*parts: str) -> str:
    """Return SUMO's messages as one line, each once."""
    lines = [" ".join(line.split()) for part in parts for line in part.strip().splitlines()]
    return " ".join(dict.fromkeys(line for line in lines if line)) or "SUMO gave no reason"


class Session:
    """The open simulation.

    Args:
        config_file: SUMO configuration (``.sumocfg``).
        step_s: Step length.
        seed: Seed of SUMO's random numbers.
        options: Further SUMO command-line options; they win over :data:`QUIET` and :data:`SAFETY`.
            Relative names of input files lie below the folder of the configuration.

    Raises:
        WorldError: A simulation is open in this process, or SUMO refuses the configuration; the message
            holds what SUMO says.
        MissingLibraryError: libsumo cannot be loaded.
    """

    _opened: ClassVar[Session | None] = None

    def __init__(self, config_file: Path, *, step_s: float, seed: int, options: tuple[str, ...] = ()) -> None:
        self.engine: ModuleType = load_libsumo()
        if LibsumoHold.held_by is not None and not LibsumoHold.held_by.gives_way():
            raise WorldError(
                "libsumo is attached to a script in this process (xgv_cosim.attach); detach() that first"
            )
        if Session._opened is not None or self.engine.isLoaded():
            raise WorldError(
                "libsumo already runs a simulation in this process and holds only one; close that one first, "
                "or run this one in a process of its own"
            )
        check_inputs(config_file, options)
        self.config_file = config_file
        self._folder = tempfile.TemporaryDirectory(prefix="xgv-cosim-sumo-")
        self._error_log = Path(self._folder.name) / "errors.txt"
        self._messages = ""
        self._start(["sumo", *arguments(config_file, step_s, seed, options, self._error_log)])
        Session._opened = self
        self.begin_s = float(self.engine.simulation.getTime())

    def _start(self, command: list[str]) -> None:
        with tempfile.TemporaryFile() as kept:
            try:
                with _stderr_kept(kept):
                    self.engine.start(command)
            except (self.engine.TraCIException, self.engine.FatalTraCIError) as error:
                with _stderr_kept(kept):
                    self._shut()
                kept.seek(0)
                said = kept.read().decode(errors="replace")
                self._folder.cleanup()
                raise WorldConfigurationError(
                    f"SUMO cannot start {self.config_file}: {sentence(str(error), said)}"
                ) from error
            kept.seek(0)
            self._messages = kept.read().decode(errors="replace")

    @classmethod
    def is_any_open(cls) -> bool:
        """Return whether libsumo holds a simulation of ours."""
        return cls._opened is not None

    @property
    def is_open(self) -> bool:
        """Return whether this is the simulation that libsumo holds."""
        return Session._opened is self

    @property
    def goes_on(self) -> bool:
        """Return that SUMO ends with ``close``."""
        return False

    @property
    def messages(self) -> tuple[str, ...]:
        """Return SUMO's warnings and errors so far, oldest first."""
        logged = self._error_log.read_text(errors="replace") if self._error_log.exists() else ""
        return tuple(line for line in (self._messages + logged).splitlines() if line.strip())

    def step(self) -> None:
        """Advance SUMO by one step.

        Raises:
            WorldError: SUMO failed; the session is closed.
        """
        with self.failures():
            self.engine.simulationStep()

    @contextmanager
    def failures(self) -> Iterator[None]:
        """Make the errors of libsumo the errors of a world; whatever talks to libsumo stands inside.

        Raises:
            WorldError: SUMO failed; the session is closed.
        """
        try:
            yield
        except (self.engine.TraCIException, self.engine.FatalTraCIError) as error:
            self.close()
            said = [line for line in self.messages if line.startswith("Error")]
            raise WorldError(f"SUMO failed in {self.config_file}: {sentence(str(error), *said)}") from error

    def close(self) -> None:
        """End the simulation; its messages stay readable. Does nothing when it is closed."""
        if not self.is_open:
            return
        Session._opened = None
        self._shut()
        self._messages = "\n".join(self.messages)
        self._folder.cleanup()

    def _shut(self) -> None:
        if self.engine.isLoaded():
            self.engine.close()
