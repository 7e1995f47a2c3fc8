"""The door to libsumo: quiet, and clear about system libraries that lack."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from xgv_cosim.errors import MissingLibraryError, WorldError
from xgv_cosim.worlds.sumo import libraries

NOTICE = (
    "Warning! pyarrow is installed with version 1.2 which might be incompatible with libsumo\\n"
    " Try to uninstall pyarrow or install a matching pyarrow version, if you encounter problems."
)


@pytest.fixture
def private_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A data folder of the user's that holds nothing yet."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    return libraries.private_library_folder()


def fake_libsumo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, source: str) -> None:
    """Put a libsumo of our own in the place of the real one, which may be loaded already."""
    package = tmp_path / "packages" / "libsumo"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text(source, encoding="utf-8")
    monkeypatch.syspath_prepend(str(package.parent))
    monkeypatch.delitem(sys.modules, "libsumo", raising=False)


def lacking(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    monkeypatch.setattr(libraries, "can_load", lambda library: str(library) not in names)


def test_the_real_libsumo_comes_without_a_word_on_stdout() -> None:
    code = "from xgv_cosim.worlds.sumo.libraries import load_libsumo; assert load_libsumo() is load_libsumo()"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_only_the_known_notice_is_dropped_and_other_words_go_to_stderr(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], private_folder: Path
) -> None:
    fake_libsumo(tmp_path, monkeypatch, f'print("{NOTICE}")\nprint("licence expires tomorrow")\n')
    libraries.load_libsumo()
    monkeypatch.delitem(sys.modules, "libsumo")
    assert capfd.readouterr() == ("", "licence expires tomorrow\n")


def test_all_missing_libraries_are_named_with_the_line_that_installs_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, private_folder: Path
) -> None:
    fake_libsumo(
        tmp_path, monkeypatch, 'raise ImportError("libGL.so.1: cannot open shared object file: No such file")'
    )
    lacking(monkeypatch, "libGL.so.1", "libX11.so.6")
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    with pytest.raises(MissingLibraryError) as caught:
        libraries.load_libsumo()
    assert caught.value.libraries == ("libX11.so.6", "libGL.so.1")
    message = str(caught.value)
    assert "libX11.so.6, libGL.so.1" in message
    assert "sudo apt-get install -y libx11-6 libxext6 libxrender1 libgl1 libatomic1" in message
    assert "xgv-cosim doctor --fix" in message


def test_root_is_not_told_to_use_sudo(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    assert libraries.install_command().startswith("apt-get install")


def test_a_library_that_nobody_foresaw_is_named_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, private_folder: Path
) -> None:
    fake_libsumo(
        tmp_path,
        monkeypatch,
        'raise ImportError("libnew-2.so.7: cannot open shared object file: No such file")',
    )
    lacking(monkeypatch)
    with pytest.raises(MissingLibraryError, match=r"libnew-2\.so\.7") as caught:
        libraries.load_libsumo()
    assert caught.value.libraries == ("libnew-2.so.7",)


def test_another_import_error_keeps_its_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, private_folder: Path
) -> None:
    fake_libsumo(tmp_path, monkeypatch, 'raise ImportError("bad magic number")')
    lacking(monkeypatch)
    with pytest.raises(WorldError, match="bad magic number") as caught:
        libraries.load_libsumo()
    assert not isinstance(caught.value, MissingLibraryError)


def test_private_libraries_load_in_the_order_of_their_needs(
    monkeypatch: pytest.MonkeyPatch, private_folder: Path
) -> None:
    """A library loads only after those that it needs; one that lacks something for good is left out."""
    needs = {
        "libX11.so.6.4.0": "libxcb.so.1.1.0",
        "libxcb.so.1.1.0": "libXau.so.6.0.0",
        "libdri.so.1.0": "libLLVM.so.15",
    }
    for name in ("libX11.so.6.4.0", "libXau.so.6.0.0", "libdri.so.1.0", "libxcb.so.1.1.0"):
        path = private_folder / "usr" / "lib" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    loaded: list[str] = []

    def can_load(library: str | Path) -> bool:
        name = Path(library).name
        if name in needs and needs[name] not in loaded:
            return False
        loaded.append(name)
        return True

    monkeypatch.setattr(libraries, "can_load", can_load)
    paths = libraries.preload_private_libraries(private_folder)
    assert [path.name for path in paths] == ["libXau.so.6.0.0", "libxcb.so.1.1.0", "libX11.so.6.4.0"]


def test_private_libraries_are_tried_before_a_library_counts_as_missing(
    monkeypatch: pytest.MonkeyPatch, private_folder: Path
) -> None:
    brought = private_folder / "libatomic.so.1.2.0"
    brought.parent.mkdir(parents=True)
    brought.touch()
    loaded: list[str] = []

    def can_load(library: str | Path) -> bool:
        loaded.append(str(library))
        return str(library) != "libatomic.so.1" or str(brought) in loaded

    monkeypatch.setattr(libraries, "can_load", can_load)
    assert libraries.missing_libraries() == ()
    assert str(brought) in loaded


def test_the_loader_really_says_what_is_not_there() -> None:
    assert not libraries.can_load("libxgv-cosim-has-no-such-library.so.1")
    assert libraries.can_load("libc.so.6")
