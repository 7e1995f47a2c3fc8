"""Runs: a scenario becomes a recorded run folder; a run folder can be replayed."""

from __future__ import annotations

from xgv_cosim.runs.replay import Replay, replay
from xgv_cosim.runs.result import RunResult, RunStatus
from xgv_cosim.runs.running import Progress, run_scenario

__all__ = ["Progress", "Replay", "RunResult", "RunStatus", "replay", "run_scenario"]
