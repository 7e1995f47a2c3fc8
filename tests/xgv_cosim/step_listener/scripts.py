"""What the scripts of these tests share; they run SUMO themselves, as a user's do."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from xgv_cosim.entry import simulate
from xgv_cosim.fleet import Fleet
from xgv_cosim.recording.trace import TraceHash
from xgv_cosim.scenario.loading import load_scenario
from xgv_cosim.snapshot import Snapshot

LIKE_OURS = [
    "--collision.action=warn",
    "--collision.mingap-factor=0",
    "--collision.check-junctions=true",
    "--time-to-teleport=-1",
    "--lanechange.duration=3",
]
"""The options that a headless run sets."""
QUIET = ["--no-step-log=true", "--duration-log.disable=true", "--no-warnings=true"]


def config_of(scenario: str) -> Path:
    """Return the .sumocfg of a packaged scenario."""
    loaded = load_scenario(scenario)
    return loaded.source.folder / loaded.world.sumo.config


def command(
    config: Path, *, seed: int = 1, step_s: float = 0.1, options: Sequence[str] = LIKE_OURS
) -> list[str]:
    """Return how a script starts SUMO."""
    return [
        "sumo",
        f"--configuration-file={config}",
        f"--step-length={step_s}",
        f"--seed={seed}",
        *QUIET,
        *options,
    ]


class Trace:
    """Observes: the trace hash, and the exact columns of all vehicles."""

    def __init__(self) -> None:
        self.hash = TraceHash()
        self.rows: list[tuple[Any, ...]] = []

    def record_event(self, event: object) -> None:
        """Nothing to do."""

    def record_step(self, tick: int, fleet: Fleet, snapshot: Snapshot) -> None:
        self.hash.update(tick, fleet, snapshot)
        columns = (snapshot.front_x_m, snapshot.front_y_m, snapshot.heading_rad, snapshot.speed_mps)
        self.rows.append((tick, snapshot.time_s, snapshot.ids, *(column.tobytes() for column in columns)))


def headless_trace(scenario: str, num_steps: int, *, seed: int = 1) -> Trace:
    """Return the trace of a packaged scenario, run by the project itself."""
    trace = Trace()
    with simulate(scenario, seed=seed, observers=[trace]) as simulation:
        for _ in range(num_steps):
            simulation.step()
    return trace
