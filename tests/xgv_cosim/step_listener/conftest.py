"""SUMO as a script runs it: in the process, or in a process of its own behind a socket."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import pytest
import sumo
import traci

from xgv_cosim.worlds.sumo.libraries import load_libsumo

BINARY = f"{sumo.SUMO_HOME}/bin/sumo"


@dataclass
class Script:
    """What a script imports, and how it starts SUMO there."""

    module: Any
    """The module, as ``import ... as traci`` gives it."""
    processes: list[subprocess.Popen[bytes]] = field(default_factory=list)

    @property
    def is_over_socket(self) -> bool:
        return self.module is traci

    def start(self, command: list[str], label: str = "default") -> None:
        """Start SUMO; over a socket as ``traci.start`` does, but without its sleeps of a second."""
        if not self.is_over_socket:
            self.module.start(command)
            return
        port = traci.main.getFreeSocketPort()
        process = subprocess.Popen([BINARY, *command[1:], "--remote-port", str(port)])
        self.processes.append(process)
        while process.poll() is None:
            try:
                traci.connect(port, numRetries=0, proc=process, waitBetweenRetries=0, label=label)
            except traci.FatalTraCIError:
                continue
            break
        traci.switch(label)

    def end(self) -> None:
        """Close whatever is open, and wait for the processes."""
        if not self.is_over_socket:
            if self.module.isLoaded():
                self.module.close()
            return
        for label in [name for name in traci.connection._connections if name]:
            traci.switch(label)
            traci.close(wait=False)
        for process in self.processes:
            process.kill()
            process.wait()


@pytest.fixture
def libsumo() -> Iterator[ModuleType]:
    """The module libsumo, closed at the end whatever the script did."""
    script = Script(load_libsumo())
    yield script.module
    script.end()


@pytest.fixture
def over_socket() -> Iterator[Script]:
    """Traci over a socket, with a real ``sumo``."""
    script = Script(traci)
    yield script
    script.end()


@pytest.fixture(params=["libsumo", "traci"])
def script(request: pytest.FixtureRequest) -> Iterator[Script]:
    """Either of them: what holds for one holds for the other."""
    script = Script(load_libsumo() if request.param == "libsumo" else traci)
    yield script
    script.end()
