"""The run folder: names of its files, and the rule that one folder holds one run."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from xgv_cosim.errors import FolderInUseError
from xgv_cosim.recording.disk import fail

EVENTS: Final = "events.jsonl"
TRACE: Final = "trace.csv"
TRAJECTORY: Final = "trajectory.parquet"
ROAD: Final = "road.json"
RESULT: Final = "result.json"
LOCK: Final = "scenario.lock.yaml"
REPORT: Final = "report.html"
RESERVE: Final = ".reserve"
RESULT_SCHEMA: Final = "xgv-cosim/result/1"
"""Name and version of the form of ``result.json``."""

_BEFORE_THE_RUN = frozenset({LOCK})
"""What may lie in the folder before the recording begins: the caller's description of this run."""


def prepare_run_folder(folder: Path) -> Path:
    """Make ``folder`` for a new run, and return it.

    A folder that holds anything but a ``scenario.lock.yaml`` is refused, whatever it holds: nothing is
    ever overwritten, and two runs never mix.

    Raises:
        FolderInUseError: It is not a folder, or is not empty.
        RecordingError: It cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        present = sorted(entry.name for entry in folder.iterdir())
    except FileExistsError as error:
        raise FolderInUseError(
            f"cannot use {folder} as run folder: it is a file; name a new folder"
        ) from error
    except OSError as error:
        fail(folder, error, "Nothing was recorded; name a folder that you may write to.")
    in_the_way = [name for name in present if name not in _BEFORE_THE_RUN]
    if in_the_way:
        what = "holds another run" if {RESULT, EVENTS, TRACE} & set(in_the_way) else "is not empty"
        shown = ", ".join(in_the_way[:4]) + (", ..." if len(in_the_way) > 4 else "")
        raise FolderInUseError(
            f"cannot use {folder} as run folder: it {what} ({shown}). "
            "Name a new folder, or delete this one first; nothing was changed."
        )
    return folder
