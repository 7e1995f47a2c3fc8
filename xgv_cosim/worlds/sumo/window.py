"""One simulation in a window of sumo-gui: a process of its own, spoken to over a socket."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from xgv_cosim.errors import WorldConfigurationError, WorldError
from xgv_cosim.worlds.sumo.inputs import check_inputs
from xgv_cosim.worlds.sumo.session import arguments, sentence

if TYPE_CHECKING:
    from collections.abc import Iterator

    from xgv_cosim.worlds.sumo.socket_engine import SocketEngine

INSTALL = "pip install 'xgv-cosim[gui]'"
"""How to get sumo-gui."""
_WITHOUT_DISPLAY = "run it on a desktop, with ssh -X or under xvfb-run, or run without the window"
_LOOKS_AGAIN_S = 0.02
"""Pause between two looks whether SUMO has opened its socket."""
_PATIENCE_S = 10.0
"""How long SUMO may take to end by itself."""


def find_sumo_gui() -> Path:
    """Return the program sumo-gui: of the extra ``gui``, else the one on the path.

    Raises:
        WorldError: There is none.
    """
    try:
        import sumo  # noqa: PLC0415 - absent without the extra
    except ImportError:
        on_path = shutil.which("sumo-gui")
        if on_path is None:
            raise WorldError(f"sumo-gui is not installed; install the extra: {INSTALL}") from None
        return Path(on_path)
    return Path(sumo.SUMO_HOME, "bin", "sumo-gui")


def require_display() -> None:
    """Check that there is a display to open a window on.

    Raises:
        WorldError: There is none.
    """
    if not os.environ.get("DISPLAY"):
        raise WorldError(f"sumo-gui needs a display, and DISPLAY is not set; {_WITHOUT_DISPLAY}")


class Window:
    """A simulation in sumo-gui. Implements ``OpenSimulation``.

    Args:
        config_file: SUMO configuration (``.sumocfg``).
        step_s: Step length.
        seed: Seed of SUMO's random numbers.
        options: Further SUMO command-line options; see ``Session``.
        delay_ms: Wall time that each step takes at least; the window has a field for it too.

    Raises:
        WorldError: sumo-gui or a display is missing, or SUMO refuses the configuration; the message holds
            what SUMO says.
    """

    engine: SocketEngine
    begin_s: float

    def __init__(
        self, config_file: Path, *, step_s: float, seed: int, options: tuple[str, ...] = (), delay_ms: float
    ) -> None:
        program = find_sumo_gui()
        require_display()
        check_inputs(config_file, options)
        self.config_file = config_file
        self._folder = tempfile.TemporaryDirectory(prefix="xgv-cosim-sumo-")
        self._error_log = Path(self._folder.name) / "errors.txt"
        self._said = Path(self._folder.name) / "said.txt"
        self._messages: tuple[str, ...] = ()
        self._connection: Any = None
        port = _free_port()
        own = {
            "--start": "true",
            "--quit-on-end": "true",
            "--delay": f"{delay_ms:g}",
            "--remote-port": str(port),
        }
        given = {option.partition("=")[0] for option in options}
        command = [
            str(program),
            *arguments(config_file, step_s, seed, options, self._error_log),
            *(f"{name}={value}" for name, value in own.items() if name not in given),
        ]
        with self._said.open("wb") as said:
            self._process = subprocess.Popen(  # noqa: S603 - SUMO itself, with the options of the run
                command, stdin=subprocess.DEVNULL, stdout=said, stderr=subprocess.STDOUT
            )
        try:
            self._connect(port)
            self.begin_s = float(self.engine.simulation.getTime())
        except BaseException:
            self.close()
            raise

    def _connect(self, port: int) -> None:
        """Wait for SUMO to read its input and to open its socket.

        Raises:
            WorldConfigurationError: It has ended instead, over its input.
            WorldError: It has ended instead, for want of a display.
        """
        from traci.connection import Connection  # noqa: PLC0415 - only where SUMO runs in a process of its own

        from xgv_cosim.worlds.sumo.socket_engine import SocketEngine  # noqa: PLC0415 - likewise

        while self._process.poll() is None:
            try:
                self._connection = Connection("localhost", port, self._process, None, True)
            except OSError:
                time.sleep(_LOOKS_AGAIN_S)
                continue
            self.engine = SocketEngine(self._connection)
            self.engine.remember()
            return
        said = sentence(self._said.read_text(errors="replace"), *self.messages)
        if "unable to open display" in said:
            raise WorldError(
                f"sumo-gui cannot open the display {os.environ['DISPLAY']!r} that DISPLAY names; "
                f"{_WITHOUT_DISPLAY}"
            )
        raise WorldConfigurationError(f"sumo-gui cannot start {self.config_file}: {said}")

    @property
    def is_open(self) -> bool:
        """Return whether the window is there."""
        return self._connection is not None

    @property
    def goes_on(self) -> bool:
        """Return that SUMO ends with ``close``."""
        return False

    @property
    def messages(self) -> tuple[str, ...]:
        """Return SUMO's warnings and errors so far, oldest first."""
        logged = self._error_log.read_text(errors="replace") if self._error_log.exists() else ""
        return tuple(line for line in logged.splitlines() if line.strip()) or self._messages

    def step(self) -> None:
        """Advance SUMO by one step.

        Raises:
            WorldError: SUMO failed, or its window was closed.
        """
        with self.failures():
            self.engine.send()
            self._connection.simulationStep()
            self.engine.look_ahead()

    @contextmanager
    def failures(self) -> Iterator[None]:
        """Make SUMO's errors the errors of a world; whatever talks to it stands inside.

        Raises:
            WorldError: SUMO failed; the simulation is closed.
        """
        try:
            yield
        except (self.engine.TraCIException, self.engine.FatalTraCIError) as error:
            self.close()
            said = [line for line in self.messages if line.startswith("Error")]
            words = "its window was closed" if not said and self._process.returncode == 0 else str(error)
            raise WorldError(f"sumo-gui has ended in {self.config_file}: {sentence(words, *said)}") from error

    def close(self) -> None:
        """End SUMO; its messages stay readable. Does nothing when it is closed."""
        connection, self._connection = self._connection, None
        if connection is not None and self._process.poll() is None:
            try:
                connection.close(wait=False)
            except (self.engine.TraCIException, self.engine.FatalTraCIError, OSError):
                self._process.terminate()  # it has gone by itself, or does not answer any more
        elif self._process.poll() is None:
            self._process.terminate()
        try:
            self._process.wait(_PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._messages = self.messages
        self._folder.cleanup()


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        port: int = probe.getsockname()[1]
        return port
