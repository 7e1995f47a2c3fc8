"""How the command line ends when something unexpected happens."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from xgv_cosim.cli import app as command_line
from xgv_cosim.cli import main
from xgv_cosim.errors import FolderInUseError, RecordingError

if TYPE_CHECKING:
    from pathlib import Path


def code_of(*arguments: str) -> object:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return ended.value.code


def test_a_fault_of_ours_is_exit_code_3_with_its_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken() -> None:
        raise ZeroDivisionError("no such luck")

    monkeypatch.setattr("sumo_scenarios.list_scenarios", broken)
    assert code_of("scenarios") == 3
    said = capsys.readouterr().err
    assert "Traceback (most recent call last)" in said
    assert "ZeroDivisionError: no such luck" in said
    assert said.splitlines()[-1] == "this is a fault of xgv-cosim; please report it"


def test_an_interrupt_outside_a_command_is_exit_code_130(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(args: list[str]) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(command_line, "app", interrupted)
    assert code_of("scenarios") == 130


def test_an_interrupt_within_a_command_is_exit_code_130(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sumo_scenarios.list_scenarios", interrupted)
    assert code_of("scenarios") == 130


def test_a_folder_that_holds_something_is_wrong_usage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "thesis.tex").write_text("x")
    assert code_of("run", "hello", "--out", str(tmp_path)) == 2
    assert "is not empty (thesis.tex)" in capsys.readouterr().err
    assert code_of("run", "hello", "--out", str(tmp_path / "thesis.tex")) == 2
    assert issubclass(FolderInUseError, RecordingError)
