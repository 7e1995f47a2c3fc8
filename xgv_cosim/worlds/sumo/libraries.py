"""The one door to libsumo: a quiet import, and a clear error where the system lacks its libraries.

The libsumo wheel brings most of what it links, but not the X and OpenGL client libraries that SUMO's
(unused) window system needs, nor libatomic. Bare servers and containers have none of them. Whoever may
install packages installs them; whoever may not can have them in the user's data folder
(``xgv-cosim doctor --fix``, see :mod:`xgv_cosim.worlds.sumo.provisioning`), from where they are loaded
here before the wheel asks for them: the dynamic loader takes a library that is already loaded under the
wanted name.
"""

from __future__ import annotations

import contextlib
import ctypes
import io
import os
import re
import sys
from typing import TYPE_CHECKING

import platformdirs

from xgv_cosim.errors import MissingLibraryError, WorldError

if TYPE_CHECKING:
    from pathlib import Path
    from types import ModuleType

SYSTEM_LIBRARIES = {
    "libX11.so.6": "libx11-6",
    "libXext.so.6": "libxext6",
    "libXrender.so.1": "libxrender1",
    "libGL.so.1": "libgl1",
    "libatomic.so.1": "libatomic1",
}
"""Shared libraries that the libsumo wheel expects of the system, and the Debian package of each."""

_MISSING_OBJECT = re.compile(r"(?P<name>[\w.+-]+\.so[\w.]*): cannot open shared object file")
# What libsumo prints on stdout when pyarrow is there in another version than the one it bundles for
# itself. The two never meet (the bundled one has a name of its own), so the advice is noise.
_PYARROW_NOTICE = (
    "Warning! pyarrow is installed with version",
    " Try to uninstall pyarrow or install a matching",
)


def install_command() -> str:
    """Return the line that installs all of :data:`SYSTEM_LIBRARIES` on Debian and Ubuntu."""
    prefix = "" if os.geteuid() == 0 else "sudo "  # bare machines on which one is root have no sudo
    return f"{prefix}apt-get install -y {' '.join(SYSTEM_LIBRARIES.values())}"


def private_library_folder() -> Path:
    """Return where system libraries lie that were fetched without administrator rights."""
    return platformdirs.user_data_path("xgv-cosim") / "system-libraries"


def can_load(library: str | Path) -> bool:
    """Return whether the dynamic loader finds a library and all that it needs; it stays loaded."""
    try:
        ctypes.CDLL(str(library))
    except OSError:
        return False
    return True


def missing_libraries() -> tuple[str, ...]:
    """Return which of :data:`SYSTEM_LIBRARIES` cannot be loaded, after trying the private folder."""
    missing = tuple(name for name in SYSTEM_LIBRARIES if not can_load(name))
    if missing and private_library_folder().is_dir():
        preload_private_libraries(private_library_folder())
        missing = tuple(name for name in missing if not can_load(name))
    return missing


def preload_private_libraries(folder: Path) -> tuple[Path, ...]:
    """Load every shared library below ``folder`` that can be loaded; return those that were.

    A library needs others of the folder, and the loader does not search there: whatever fails for want
    of another is tried again until a whole round brings nothing new.
    """
    waiting = sorted(path for path in folder.rglob("*.so.*") if path.is_file() and not path.is_symlink())
    loaded: list[Path] = []
    while waiting:
        fresh = [path for path in waiting if can_load(path)]
        if not fresh:
            break
        loaded += fresh
        waiting = [path for path in waiting if path not in fresh]
    return tuple(loaded)


def remedy_for(libraries: tuple[str, ...]) -> str:
    """Return the sentence that tells how to get missing libraries."""
    strangers = [name for name in libraries if name not in SYSTEM_LIBRARIES]
    if strangers:
        return f"Install the packages that bring {', '.join(strangers)}, then: {install_command()}"
    return f"Install them: `{install_command()}`, or have them fetched without root: `xgv-cosim doctor --fix`"


def load_libsumo() -> ModuleType:
    """Import libsumo and return it; what it prints while it is imported goes to stderr.

    Raises:
        MissingLibraryError: The system lacks libraries that libsumo links; names them all and the remedy.
        WorldError: libsumo is not installed, or its import fails for another reason.
    """
    if "libsumo" in sys.modules:
        return sys.modules["libsumo"]
    if private_library_folder().is_dir():
        missing_libraries()
    printed = io.StringIO()
    try:
        with contextlib.redirect_stdout(printed):
            import libsumo  # noqa: PLC0415 - heavy, and absent libraries are an error only where SUMO is used
    except ImportError as error:
        libraries = missing_libraries()
        stranger = _MISSING_OBJECT.search(str(error))
        if stranger and stranger["name"] not in SYSTEM_LIBRARIES:
            libraries = (*libraries, stranger["name"])
        if libraries:
            raise MissingLibraryError(libraries, remedy_for(libraries)) from error
        raise WorldError(
            f"libsumo cannot be imported: {error}. Install xgv-cosim with its dependencies."
        ) from error
    for line in printed.getvalue().splitlines():
        if not line.startswith(_PYARROW_NOTICE):
            sys.stderr.write(f"{line}\n")
    module: ModuleType = libsumo
    return module
