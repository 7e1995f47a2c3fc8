"""Machine code on disk is found again, and never for sources that it was not made from."""

from __future__ import annotations

import importlib.util
import logging
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import platformdirs
import pytest
from numba.core import config

from xgv_cosim import jit, kernel
from xgv_cosim.fleet_columns import Motion

PACKAGE = Path(kernel.__file__).parent.parent


def test_an_edit_of_any_source_changes_the_key(tmp_path: Path) -> None:
    """numba's own cache would not notice an edit of a called module."""
    copies = [
        Path(shutil.copy(path, tmp_path / f"{number}_{path.name}")) for number, path in enumerate(_sources())
    ]
    key = jit.cache_key(copies)
    assert jit.cache_key(reversed(copies)) == key
    for path in copies:
        text = path.read_text(encoding="utf-8")
        path.write_text(text + "# edited\n", encoding="utf-8")
        assert jit.cache_key(copies) != key, path.name
        path.write_text(text, encoding="utf-8")
    assert jit.cache_key(copies) == key


def test_the_key_tells_interpreters_libraries_and_processors_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    key = jit.cache_key(_sources())
    for target, name, value in (
        (jit.numba, "__version__", "0.0.1"),
        (jit.np, "__version__", "0.0.1"),
        (jit.platform, "python_version", lambda: "3.99.0"),
        (jit, "get_host_cpu_name", lambda: "another"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(target, name, value)
            assert jit.cache_key(_sources()) != key, name


def test_every_module_that_the_kernel_calls_is_in_the_key() -> None:
    """What the loop imports of this package in a fresh process, less what holds no compiled code."""
    code = """
import sys
import xgv_cosim
before = set(sys.modules)
import xgv_cosim.kernel.loop
print(*(name for name in set(sys.modules) - before if name.startswith("xgv_cosim")))
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    imported = {Path(_origin(name)) for name in run.stdout.split()}
    assert PACKAGE / "plant" / "pose.py" in imported
    without_code = {PACKAGE / f"{name}.py" for name in ("errors", "commands", "columns")}
    assert imported - without_code <= set(_sources())


def test_an_edited_callee_is_compiled_anew_although_numba_would_not_see_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda _: tmp_path / "cache")
    callee, caller = tmp_path / "cache_test_callee.py", tmp_path / "cache_test_caller.py"
    caller.write_text(
        "from cache_test_callee import step\n\ndef run(x):\n    return step(x)\n", encoding="utf-8"
    )
    monkeypatch.syspath_prepend(tmp_path)
    answers = []
    for factor in (2, 2, 3):
        callee.write_text(
            f"from xgv_cosim.jit import inlinable\n\n@inlinable\ndef step(x):\n    return {factor}.0 * x\n",
            encoding="utf-8",
        )
        run = jit.compiled(_fresh(callee, caller).run, [callee, caller])
        answers.append((run(1.0), sum(run.stats.cache_hits.values())))
    assert answers == [(2.0, 0), (2.0, 1), (3.0, 0)]
    assert len(list((tmp_path / "cache" / "kernels").iterdir())) == 2


def test_numbas_setting_is_left_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda _: tmp_path)
    before = config.CACHE_DIR
    jit.compiled(kernel.kernel_sources, [])
    assert before == config.CACHE_DIR


def test_without_a_writable_folder_it_compiles_without_cache_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way of the folder", encoding="utf-8")
    monkeypatch.setattr(platformdirs, "user_cache_path", lambda _: blocked)
    with caplog.at_level(logging.WARNING):
        double = jit.compiled(lambda x: 2.0 * x, [])
    assert double(4.0) == 8.0
    assert "compiled anew" in caplog.text


def test_warming_up_is_enough_for_a_fleet_of_any_size() -> None:
    kernel.warm_up()
    compiled = kernel._advance_compiled
    signatures = len(compiled.signatures)
    from tests.xgv_cosim.kernel.fleets import at_rest, setpoints
    from xgv_cosim.parameters import VehicleParameters, parameter_columns

    motion, reference = at_rest(33)
    after, _ = kernel.advance(
        motion, reference, setpoints(33), parameter_columns(VehicleParameters(), 33), 10
    )
    assert isinstance(after, Motion)
    assert len(compiled.signatures) == signatures


def _sources() -> list[Path]:
    return kernel.kernel_sources()


def _origin(name: str) -> str:
    spec = importlib.util.find_spec(name)
    assert spec is not None
    return spec.origin or ""


def _fresh(*paths: Path) -> ModuleType:
    """Import files anew, in order, and return the last module."""
    for path in paths:
        spec = importlib.util.spec_from_file_location(path.stem, path)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[path.stem] = module
        source = compile(path.read_text(encoding="utf-8"), str(path), "exec")
        exec(source, module.__dict__)
    return module
