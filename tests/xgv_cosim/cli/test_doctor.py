"""``xgv-cosim doctor``: every check against the real thing and against a broken one."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from xgv_cosim.cli import diagnosis, main
from xgv_cosim.cli.diagnosis import Finding
from xgv_cosim.errors import MissingLibraryError, WorldError, XgvCosimError
from xgv_cosim.worlds.sumo import provisioning

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

BROKEN = [
    Finding("python", ok=True, detail="3.11.2"),
    Finding("disk", ok=False, detail="full", remedy="Tidy up."),
]


def doctor(*options: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["doctor", *options])
    assert isinstance(ended.value.code, int)
    return ended.value.code


@pytest.fixture
def nothing_to_fix(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(provisioning, "missing_libraries", tuple)


def finding(findings: Iterator[Finding] | list[Finding], name: str) -> Finding:
    return next(row for row in findings if row.name == name)


def test_this_machine_passes_and_json_parses(tmp_path: Path) -> None:
    """The whole command in a process of its own: real libsumo, ruckig, numba; one JSON object and no more."""
    command = [sys.executable, "-c", "from xgv_cosim.cli import main; main(['doctor', '--json'])"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    report = json.loads(done.stdout)
    assert (done.returncode, done.stderr) == (0, "")
    assert report["ok"] is True
    names = {row["name"] for row in report["findings"]}
    assert {"python", "libsumo", "ruckig", "system libraries", "libsumo drives", "ruckig plans"} <= names
    assert {"numba compiles", "working folder", "cache folder"} <= names
    assert all(row["ok"] and row["detail"] and not row["remedy"] for row in report["findings"])


def test_a_problem_ends_with_3_and_its_remedy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(diagnosis, "diagnose", lambda: iter(BROKEN))
    assert doctor() == 3
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["ok", "python", "3.11.2"]
    assert lines[1].split() == ["problem", "disk", "full", "->", "Tidy", "up."]
    assert lines[2] == "1 of 2 checks found a problem"


def test_a_problem_in_json(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(diagnosis, "diagnose", lambda: iter(BROKEN))
    assert doctor("--json") == 3
    report = json.loads(capsys.readouterr().out)
    assert report["ok"] is False
    assert report["findings"][1] == {"name": "disk", "ok": False, "detail": "full", "remedy": "Tidy up."}


def test_a_terminal_gets_a_table(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(diagnosis, "diagnose", lambda: iter(BROKEN))
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    assert doctor() == 3
    shown = capsys.readouterr().out
    assert "✓" in shown
    assert "✗" in shown
    assert "Tidy up." in shown


@pytest.mark.usefixtures("nothing_to_fix")
def test_fix_with_nothing_to_fix_shows_problems_only(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(diagnosis, "diagnose", lambda: iter(BROKEN[:1]))
    assert doctor("--fix") == 0
    assert capsys.readouterr() == ("all checks passed\n", "")
    monkeypatch.setattr(diagnosis, "diagnose", lambda: iter(BROKEN))
    assert doctor("--fix") == 3
    assert "python" not in capsys.readouterr().out


def test_fix_that_fails_is_a_problem_in_json_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(_announce: object) -> tuple[str, ...]:
        raise WorldError("apt said no")

    monkeypatch.setattr(provisioning, "provide_libraries", fail)
    monkeypatch.setattr(diagnosis, "diagnose", lambda: iter(BROKEN[:1]))
    assert doctor("--fix", "--json") == 3
    report = json.loads(capsys.readouterr().out)
    assert finding([Finding(**row) for row in report["findings"]], "fix").detail == "apt said no"


def test_what_fix_got_is_said(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(provisioning, "provide_libraries", lambda _announce: ("libGL.so.1",))
    monkeypatch.setattr(diagnosis, "diagnose", lambda: iter(BROKEN[:1]))
    assert doctor("--fix", "--json") == 0
    report = json.loads(capsys.readouterr().out)
    assert finding([Finding(**row) for row in report["findings"]], "fix").detail == "got libGL.so.1"


@pytest.mark.parametrize(
    ("version", "ok"), [((3, 10, 9), False), ((3, 11, 0), True), ((3, 13, 5), True), ((3, 14, 0), False)]
)
def test_python_versions(version: tuple[int, int, int], ok: bool) -> None:
    found = diagnosis.check_python(version)
    assert found.ok is ok
    assert bool(found.remedy) is not ok


def test_core_packages_are_those_of_the_project_without_extras() -> None:
    names = diagnosis.core_packages()
    assert {"libsumo", "highway-env", "eclipse-zenoh", "ruckig", "numba", "pyarrow"} <= set(names)
    assert "pytest" not in names


def test_a_package_that_is_not_there_is_a_problem() -> None:
    there, absent = diagnosis.check_packages(("numpy", "xgv-cosim-has-no-such-package"))
    assert there.ok
    assert (absent.ok, absent.detail) == (False, "not installed")
    assert absent.remedy


def test_missing_system_libraries_are_a_problem_and_sumo_is_not_started(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(diagnosis, "missing_libraries", lambda: ("libGL.so.1",))
    findings = list(diagnosis.diagnose())
    found = finding(findings, "system libraries")
    assert (found.ok, found.detail) == (False, "missing: libGL.so.1")
    assert "apt-get install" in found.remedy
    assert not [row for row in findings if row.name == "libsumo drives"]


def test_a_crash_of_sumo_is_a_problem(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(diagnosis.sys, "executable", "/bin/false")
    found = diagnosis.check_sumo()
    assert (found.ok, found.detail) == (False, "ended with code 1")


@pytest.mark.parametrize(
    "error", [XgvCosimError("wrong answer"), MissingLibraryError(("libz.so",), ""), ImportError("no")]
)
def test_a_check_turns_errors_into_findings(error: Exception) -> None:
    def call() -> str:
        raise error

    found = diagnosis.check_call("a call", call)
    assert (found.ok, found.detail) == (False, str(error))


def test_folders_are_tried_by_writing(tmp_path: Path) -> None:
    assert diagnosis.check_writable("cache folder", tmp_path / "new" / "cache").ok
    (tmp_path / "file").touch()
    found = diagnosis.check_writable("cache folder", tmp_path / "file" / "cache")
    assert not found.ok
    assert str(tmp_path / "file" / "cache") in found.detail
    assert found.remedy
