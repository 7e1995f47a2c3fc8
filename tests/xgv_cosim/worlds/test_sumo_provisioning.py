"""Getting libsumo's system libraries, against commands of our own that write down how they were called."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import pytest

from xgv_cosim.errors import MissingLibraryError, WorldError
from xgv_cosim.worlds.sumo import libraries, provisioning

if TYPE_CHECKING:
    from pathlib import Path

PRINTED = (
    "'http://deb.example/libx11-6_1.8.4_amd64.deb' libx11-6_2%3a1.8.4-2_amd64.deb 759544 MD5Sum:00\n"
    "'http://deb.example/libllvm15_15.0.6_amd64.deb' libllvm15_1%3a15.0.6-4_amd64.deb 23115156 MD5Sum:11\n"
)


class FakeMachine:
    """Commands on a PATH of their own, the log of their calls, and libraries that they bring."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.commands = folder / "commands"
        self.commands.mkdir()
        self.log = folder / "log"
        self.libraries_there = folder / "libraries-there"
        monkeypatch.setenv("PATH", f"{self.commands}:{os.defpath}")
        monkeypatch.setenv("XDG_DATA_HOME", str(folder / "data"))
        monkeypatch.setattr(libraries, "can_load", lambda _library: self.libraries_there.exists())

    def command(self, name: str, script: str = "") -> None:
        path = self.commands / name
        path.write_text(f'#!/bin/sh\necho "{name} $*" >> {self.log}\n{script}\n', encoding="utf-8")
        path.chmod(0o755)

    def calls(self) -> list[str]:
        text = self.log.read_text(encoding="utf-8") if self.log.exists() else ""
        return text.replace(f"{self.commands}/", "").splitlines()


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FakeMachine:
    return FakeMachine(tmp_path, monkeypatch)


@pytest.fixture
def only_fake_commands(machine: FakeMachine, monkeypatch: pytest.MonkeyPatch) -> FakeMachine:
    monkeypatch.setenv("PATH", str(machine.commands))
    return machine


def be_user(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: number)


def test_nothing_is_called_when_nothing_lacks(machine: FakeMachine) -> None:
    machine.libraries_there.touch()
    machine.command("apt-get", "exit 1")
    said: list[str] = []
    assert provisioning.provide_libraries(said.append) == ()
    assert machine.calls() == said == []


def test_root_installs_the_packages(machine: FakeMachine, monkeypatch: pytest.MonkeyPatch) -> None:
    be_user(monkeypatch, 0)
    machine.command("apt-get", f'case "$1" in install) touch {machine.libraries_there};; esac')
    said: list[str] = []
    assert provisioning.provide_libraries(said.append) == tuple(libraries.SYSTEM_LIBRARIES)
    packages = "libx11-6 libxext6 libxrender1 libgl1 libatomic1"
    assert machine.calls() == [
        "apt-get update -qq",
        f"apt-get install -y -qq --no-install-recommends {packages}",
    ]
    assert len(said) == 1


def test_sudo_without_a_password_installs_them_too(
    machine: FakeMachine, monkeypatch: pytest.MonkeyPatch
) -> None:
    be_user(monkeypatch, 1000)
    machine.command("apt-get")
    machine.command("sudo", f'case "$3" in install) touch {machine.libraries_there};; esac')
    provisioning.provide_libraries(lambda _line: None)
    assert [call.split(" -")[0] for call in machine.calls()] == ["sudo"] * 3
    assert machine.calls()[0] == "sudo -n true"
    assert machine.calls()[2].startswith("sudo -n apt-get install -y")


@pytest.mark.parametrize("sudo_there", [False, True])
def test_without_rights_they_are_unpacked_into_the_data_folder(
    machine: FakeMachine, monkeypatch: pytest.MonkeyPatch, sudo_there: bool
) -> None:
    """A sudo that asks for a password counts as none; large packages are left out when small ones suffice."""
    be_user(monkeypatch, 1000)
    monkeypatch.setattr(provisioning.shutil, "which", _which(machine.commands))
    if sudo_there:
        machine.command("sudo", "exit 1")
    machine.command(
        "apt-get",
        f'case "$*" in *--print-uris*) printf \'%s\' "{PRINTED}";; *download*) touch fetched.deb;; esac',
    )
    machine.command("dpkg-deb", f'touch "$3/libX11.so.6.4.0" {machine.libraries_there}')
    provisioning.provide_libraries(lambda _line: None)
    assert (libraries.private_library_folder() / "libX11.so.6.4.0").exists()
    downloads = [call for call in machine.calls() if " download " in call]
    assert [call.rsplit(" download -qq ")[1] for call in downloads] == ["libx11-6"]
    assert not any("sudo -n apt-get" in call for call in machine.calls())


def test_large_packages_follow_when_the_small_ones_do_not_suffice(
    machine: FakeMachine, monkeypatch: pytest.MonkeyPatch
) -> None:
    be_user(monkeypatch, 1000)
    monkeypatch.setattr(provisioning.shutil, "which", _which(machine.commands))
    machine.command(
        "apt-get",
        f'case "$*" in *--print-uris*) printf \'%s\' "{PRINTED}";; '
        "*libllvm15*) touch large.deb;; *download*) touch small.deb;; esac",
    )
    machine.command("dpkg-deb", f'case "$2" in *large.deb) touch {machine.libraries_there};; esac')
    provisioning.provide_libraries(lambda _line: None)
    downloads = [call.rsplit(" download -qq ")[1] for call in machine.calls() if " download " in call]
    assert downloads == ["libx11-6", "libllvm15"]


def test_libraries_that_still_lack_afterwards_are_an_error(
    machine: FakeMachine, monkeypatch: pytest.MonkeyPatch
) -> None:
    be_user(monkeypatch, 0)
    machine.command("apt-get")
    with pytest.raises(MissingLibraryError, match="libatomic") as caught:
        provisioning.provide_libraries(lambda _line: None)
    assert caught.value.libraries == tuple(libraries.SYSTEM_LIBRARIES)


def test_a_failing_apt_is_quoted(machine: FakeMachine, monkeypatch: pytest.MonkeyPatch) -> None:
    be_user(monkeypatch, 0)
    machine.command("apt-get", 'echo "E: Could not resolve the archive" >&2; exit 100')
    with pytest.raises(WorldError, match="code 100: E: Could not resolve the archive"):
        provisioning.provide_libraries(lambda _line: None)


def test_a_system_without_apt_is_told_what_lacks(only_fake_commands: FakeMachine) -> None:
    with pytest.raises(MissingLibraryError, match="no apt-get") as caught:
        provisioning.provide_libraries(lambda _line: None)
    assert "libX11.so.6" in str(caught.value)
    assert "libx11-6" in str(caught.value)


def test_a_command_that_is_not_there_is_a_world_error(only_fake_commands: FakeMachine) -> None:
    with pytest.raises(WorldError, match="cannot run dpkg-deb"):
        provisioning.run_quietly(["dpkg-deb", "-x"])


def test_printed_uris_give_names_and_sizes() -> None:
    assert provisioning.read_printed_uris(PRINTED) == [("libx11-6", 759544), ("libllvm15", 23115156)]
    assert provisioning.read_printed_uris("E: Unable to locate package\n") == []


def _which(folder: Path):  # type: ignore[no-untyped-def]
    """A search that finds only the fake commands, whatever this machine has."""
    return lambda name: str(folder / name) if (folder / name).exists() else None
