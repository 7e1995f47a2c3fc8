"""Ctrl-C waits for the end of a step."""

from __future__ import annotations

import json
import signal
import threading
from pathlib import Path

import pytest

import xgv_cosim
from xgv_cosim.fleet import Fleet
from xgv_cosim.recording import RESULT, TraceHash, read_trace
from xgv_cosim.recording.folder import TRACE
from xgv_cosim.runs import replay
from xgv_cosim.runs.interrupts import InterruptsBetweenSteps
from xgv_cosim.snapshot import Snapshot


def test_the_first_waits_and_the_second_does_not() -> None:
    with InterruptsBetweenSteps() as interrupts:
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            interrupts.check()
        interrupts.check()
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            interrupts.check()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_one_that_still_waits_is_raised_at_the_end() -> None:
    with pytest.raises(KeyboardInterrupt), InterruptsBetweenSteps():
        signal.raise_signal(signal.SIGINT)


def test_a_handler_of_the_callers_own_is_left_alone() -> None:
    seen: list[int] = []
    own = signal.signal(signal.SIGINT, lambda number, _frame: seen.append(number))
    try:
        with InterruptsBetweenSteps() as interrupts:
            signal.raise_signal(signal.SIGINT)
            interrupts.check()
    finally:
        signal.signal(signal.SIGINT, own)
    assert seen == [signal.SIGINT]


def test_other_threads_install_nothing() -> None:
    failed: list[BaseException] = []

    def work() -> None:
        try:
            with InterruptsBetweenSteps() as interrupts:
                interrupts.check()
        except BaseException as error:  # noqa: BLE001 - handed to the test
            failed.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert failed == []


def interrupting(monkeypatch: pytest.MonkeyPatch, at_update: int) -> None:
    """Let Ctrl-C come between the update of the hash and the count of the step."""
    original = TraceHash.update
    updates = 0

    def update(self: TraceHash, tick: int, fleet: Fleet, snapshot: Snapshot) -> None:
        nonlocal updates
        original(self, tick, fleet, snapshot)
        updates += 1
        if updates == at_update:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(TraceHash, "update", update)


def test_an_interrupt_within_a_step_leaves_a_record_that_replays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched:
        interrupting(patched, 12)
        result = xgv_cosim.run("hello", out=tmp_path / "out", report=False)
    assert (result.status, result.data["num_steps"]) == ("interrupted", 12)
    assert read_trace(tmp_path / "out" / TRACE)[-1][3] == result.trace_hash[:16]
    assert replay(tmp_path / "out").identical


def test_an_interrupted_replay_is_no_verdict(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    short = ["duration_s=2", "injections=[]", "expect=[]"]
    xgv_cosim.run("hello", out=tmp_path / "out", set=short, report=False)
    assert json.loads((tmp_path / "out" / RESULT).read_text())["num_steps"] == 20
    interrupting(monkeypatch, 7)
    with pytest.raises(KeyboardInterrupt):
        replay(tmp_path / "out")
