"""Gets the system libraries that libsumo needs, by the way that the rights of the user allow.

As root, or with a sudo that asks no password, apt installs the packages. Without either, apt still
downloads: the packages are unpacked into the user's data folder and loaded from there
(:func:`xgv_cosim.worlds.sumo.libraries.missing_libraries`); the system stays as it is.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

from xgv_cosim.errors import MissingLibraryError, WorldError
from xgv_cosim.worlds.sumo.libraries import (
    SYSTEM_LIBRARIES,
    install_command,
    missing_libraries,
    private_library_folder,
    remedy_for,
)

Announce = Callable[[str], None]
"""Takes one line for the person who waits."""

_SMALL_PACKAGE_BYTES = 1_000_000
# 'URI' FILE BYTES HASH, as `apt-get --print-uris` writes it; FILE is NAME_VERSION_ARCHITECTURE.deb
_PRINTED_URI = re.compile(r"^'[^']+' (?P<name>[^_ ]+)_[^ ]+ (?P<num_bytes>\d+)", re.MULTILINE)


class Package(NamedTuple):
    """A package that apt would download."""

    name: str
    num_bytes: int


def provide_libraries(announce: Announce) -> tuple[str, ...]:
    """Get the missing system libraries of libsumo and return the names of those that were missing.

    Does nothing when none is missing.

    Raises:
        MissingLibraryError: There is no apt here, or libraries still lack afterwards.
        WorldError: apt failed; the message carries its words.
    """
    missing = missing_libraries()
    if not missing:
        return ()
    apt = shutil.which("apt-get")
    if apt is None:
        packages = ", ".join(SYSTEM_LIBRARIES[name] for name in missing)
        raise MissingLibraryError(
            missing,
            "This system has no apt-get: install what brings these libraries with its own package manager "
            f"(Debian calls the packages {packages}).",
        )
    privileged = _privileged_prefix()
    if privileged is None:
        announce(f"fetching {', '.join(missing)} into {private_library_folder()} (no root needed)")
        fetch_into_private_folder(apt, private_library_folder())
    else:
        announce(f"installing the system libraries of libsumo: {', '.join(missing)}")
        run_quietly([*privileged, apt, "update", "-qq"])
        run_quietly(
            [*privileged, apt, "install", "-y", "-qq", "--no-install-recommends", *_packages_of(missing)]
        )
    still_missing = missing_libraries()
    if still_missing:
        raise MissingLibraryError(still_missing, remedy_for(still_missing))
    return missing


def fetch_into_private_folder(apt: str, folder: Path) -> None:
    """Download the packages of libsumo's system libraries with all they depend on, and unpack them.

    Lists and archives live in a folder of their own while it lasts, so that neither rights nor lists of
    the system matter. The packages of OpenGL drivers hang on to libgl1 but nothing here draws: small
    packages come first, and the large ones only if the libraries still cannot be loaded.

    Raises:
        WorldError: apt or dpkg-deb failed.
    """
    with tempfile.TemporaryDirectory(prefix="xgv-cosim-") as scratch:
        state, cache, archives = (Path(scratch, name) for name in ("state", "cache", "archives"))
        for needed in (state / "lists" / "partial", cache / "archives" / "partial", archives):
            needed.mkdir(parents=True)
        options = [
            "-o",
            f"Dir::State={state}",
            "-o",
            f"Dir::Cache={cache}",
            "-o",
            "Dir::State::status=/var/lib/dpkg/status",
        ]
        run_quietly([apt, *options, "update", "-qq"])
        plan = [apt, *options, "install", "--print-uris", "-qq", "--no-install-recommends"]
        packages = read_printed_uris(run_quietly([*plan, *SYSTEM_LIBRARIES.values()]))
        small = [package.name for package in packages if package.num_bytes <= _SMALL_PACKAGE_BYTES]
        large = [package.name for package in packages if package.num_bytes > _SMALL_PACKAGE_BYTES]
        for batch in (small, large):
            if not batch or not missing_libraries():
                continue
            run_quietly([apt, *options, "download", "-qq", *batch], folder=archives)
            folder.mkdir(parents=True, exist_ok=True)
            for archive in sorted(archives.glob("*.deb")):
                run_quietly(["dpkg-deb", "-x", str(archive), str(folder)])
                archive.unlink()


def read_printed_uris(text: str) -> list[Package]:
    """Return the packages that ``apt-get --print-uris`` lists."""
    return [Package(found["name"], int(found["num_bytes"])) for found in _PRINTED_URI.finditer(text)]


def run_quietly(command: list[str], folder: Path | None = None) -> str:
    """Run a command without a terminal and return what it printed.

    Raises:
        WorldError: It cannot be started or fails; the message carries its last lines and the remedy.
    """
    environment = os.environ | {"DEBIAN_FRONTEND": "noninteractive", "LC_ALL": "C"}
    try:
        done = subprocess.run(  # noqa: S603 - our own fixed commands; no shell
            command,
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
    except OSError as error:
        raise WorldError(
            f"cannot run {command[0]}: {error}. Ask your administrator for: {install_command()}"
        ) from error
    if done.returncode != 0:
        last_words = "; ".join((done.stderr.strip() or done.stdout.strip()).splitlines()[-3:])
        raise WorldError(
            f"`{' '.join(command)}` failed with code {done.returncode}: {last_words or 'it said nothing'}. "
            f"Install the libraries by hand: {install_command()}"
        )
    return done.stdout


def _packages_of(libraries: Iterable[str]) -> list[str]:
    return [SYSTEM_LIBRARIES[name] for name in libraries]


def _privileged_prefix() -> list[str] | None:
    """Return what stands before a command that must run as root, None when that cannot be had."""
    if os.geteuid() == 0:
        return []
    sudo = shutil.which("sudo")
    if sudo is None:
        return None
    asks = subprocess.run([sudo, "-n", "true"], stdin=subprocess.DEVNULL, capture_output=True, check=False)  # noqa: S603
    return [sudo, "-n"] if asks.returncode == 0 else None
