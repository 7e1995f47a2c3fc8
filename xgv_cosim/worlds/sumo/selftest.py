"""A journey of one second on one empty road: proves that libsumo starts, steps and ends here.

``python -m xgv_cosim.worlds.sumo.selftest`` prints SUMO's version. It is made for a process of its own:
libsumo holds one simulation per process, and a broken native library ends the process, not the caller.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from xgv_cosim.errors import WorldError
from xgv_cosim.worlds.sumo.libraries import load_libsumo

_ROAD = """<net version="1.20">
  <location netOffset="0,0" convBoundary="0,0,100,0" origBoundary="0,0,100,0" projParameter="!"/>
  <edge id="road" from="start" to="end">
    <lane id="road_0" index="0" speed="20" length="100" shape="0,-1.6 100,-1.6"/>
  </edge>
  <junction id="start" type="dead_end" x="0" y="0" incLanes="" intLanes="" shape="0,0 0,-3.2"/>
  <junction id="end" type="dead_end" x="100" y="0" incLanes="road_0" intLanes="" shape="100,-3.2 100,0"/>
</net>
"""
_NUM_STEPS = 10
_STEP_S = 0.1


def drive_empty_road() -> str:
    """Run a vehicle for one second with libsumo and return SUMO's version.

    Raises:
        MissingLibraryError: libsumo lacks system libraries.
        WorldError: libsumo cannot be imported, started or stepped, or the vehicle did not move.
    """
    libsumo = load_libsumo()
    with tempfile.TemporaryDirectory(prefix="xgv-cosim-") as scratch:
        network = Path(scratch, "road.net.xml")
        network.write_text(_ROAD, encoding="utf-8")
        try:
            libsumo.start(
                ["sumo", "--net-file", str(network), "--step-length", str(_STEP_S), "--no-step-log"]
            )
            libsumo.route.add("along", ["road"])
            libsumo.vehicle.add("probe", "along", departSpeed="max")
            for _ in range(_NUM_STEPS):
                libsumo.simulation.step()
            travelled_m = libsumo.vehicle.getDistance("probe")
            version = str(libsumo.getVersion()[1])
        except (libsumo.TraCIException, libsumo.FatalTraCIError, RuntimeError) as error:
            raise WorldError(f"libsumo cannot run an empty road: {error}") from error
        finally:
            libsumo.close()
    if not travelled_m > 0.0:
        raise WorldError(f"libsumo ran an empty road, but its vehicle travelled {travelled_m} m")
    return version


if __name__ == "__main__":
    try:
        sys.stdout.write(f"{drive_empty_road()}\n")
    except WorldError as failure:
        sys.stderr.write(f"{failure}\n")
        sys.exit(3)
