"""Recording of runs: the run folder of ``docs/run-folder.md``, written and read back."""

from xgv_cosim.recording.disk import write_whole_file
from xgv_cosim.recording.folder import (
    EVENTS,
    LOCK,
    REPORT,
    RESULT,
    RESULT_SCHEMA,
    ROAD,
    TRACE,
    TRAJECTORY,
    prepare_run_folder,
)
from xgv_cosim.recording.recorder import Recorder
from xgv_cosim.recording.trace import TraceDifference, TraceHash, first_difference, read_trace
from xgv_cosim.recording.trajectory import Trajectory, read_trajectory

__all__ = [
    "EVENTS",
    "LOCK",
    "REPORT",
    "RESULT",
    "RESULT_SCHEMA",
    "ROAD",
    "TRACE",
    "TRAJECTORY",
    "Recorder",
    "TraceDifference",
    "TraceHash",
    "Trajectory",
    "first_difference",
    "prepare_run_folder",
    "read_trace",
    "read_trajectory",
    "write_whole_file",
]
