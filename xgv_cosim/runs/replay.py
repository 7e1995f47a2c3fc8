"""Replay: run a run folder's scenario again and compare the traces."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from xgv_cosim.errors import ReplayError
from xgv_cosim.recording import TRACE, TraceDifference, first_difference
from xgv_cosim.runs.lock import read_lock
from xgv_cosim.runs.result import RunStatus, read_result
from xgv_cosim.runs.running import Progress, run_scenario
from xgv_cosim.runs.versions import recorded_versions


@dataclass(frozen=True, slots=True)
class Replay:
    """What came of a replay."""

    recorded_hash: str
    replayed_hash: str
    difference: TraceDifference | None
    """The first world step that differs, None if the traces agree as far as the record goes."""
    steps: int
    """World steps that were compared."""
    changed_inputs: tuple[str, ...]
    """Input files that have changed since."""
    changed_versions: dict[str, tuple[str, str]]
    """Package -> (recorded, present) where they differ."""

    @property
    def identical(self) -> bool:
        """Return whether both runs did the same."""
        return self.difference is None and self.recorded_hash == self.replayed_hash


def replay(folder: Path, progress: Progress | None = None) -> Replay:
    """Run the scenario of ``folder`` again, as long as the record goes, and compare step by step.

    Raises:
        ReplayError: The folder is not a run folder, or clients on a network had a part in the run.
        WorldError: SUMO cannot start.
        KeyboardInterrupt: Ctrl-C; a replay that was cut short says nothing about the record.
    """
    lock = read_lock(folder)
    recorded = read_result(folder)
    if recorded.get("jaus") is not None:
        raise ReplayError(
            f"{folder}: clients on a network had a part in this run (--jaus), in their own time; what they "
            "did is not recorded, so it cannot be run again. Its events and trajectories are in the folder."
        )
    with tempfile.TemporaryDirectory(prefix="xgv-cosim-replay-") as scratch:
        target = Path(scratch) / "run"
        again = run_scenario(lock.scenario, target, progress=progress, num_steps=int(recorded["num_steps"]))
        if again.status is RunStatus.INTERRUPTED:
            raise KeyboardInterrupt
        difference = first_difference(folder / TRACE, target / TRACE)
    present = recorded_versions()
    return Replay(
        recorded_hash=str(recorded["trace_hash"]),
        replayed_hash=again.trace_hash,
        difference=difference,
        steps=int(recorded["num_steps"]),
        changed_inputs=lock.changed_inputs,
        changed_versions={
            name: (then, present.get(name, "absent"))
            for name, then in lock.versions.items()
            if present.get(name) != then
        },
    )
