"""The one-second journey that proves libsumo; in processes of its own, as doctor runs it."""

from __future__ import annotations

import subprocess
import sys


def python(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=False)


def test_libsumo_drives_a_vehicle_here() -> None:
    done = python("-W", "error", "-m", "xgv_cosim.worlds.sumo.selftest")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("SUMO ")
    assert len(done.stdout.splitlines()) == 1


def test_a_road_that_sumo_refuses_is_a_world_error() -> None:
    done = python(
        "-c",
        "from xgv_cosim.errors import WorldError\n"
        "from xgv_cosim.worlds.sumo import selftest\n"
        "selftest._ROAD = '<net'\n"
        "try: selftest.drive_empty_road()\n"
        "except WorldError as error: print('refused:', error)\n",
    )
    assert done.stdout.startswith("refused: libsumo cannot run an empty road")
