"""Make the networks of the benchmark anew with SUMO's own tools (package eclipse-sumo).

``python tests/benchmarks/generate_networks.py``
"""

from __future__ import annotations

import gzip
import re
import subprocess
import tempfile
from pathlib import Path

import sumo

TOOLS = Path(sumo.SUMO_HOME) / "bin"
HERE = Path(__file__).parents[2] / "xgv_cosim" / "bench" / "networks"
FREEWAY_EDGES = 75
FREEWAY_EDGE_M = 2000
FREEWAY_LANES = 3
GRID = (
    "--grid",
    "--grid.length=200",
    "-L=2",
    "--tls.guess",
    "--tls.guess.threshold=0",
    "--no-turnarounds",
    "--default.junctions.radius=10",  # turns that a car can drive, at a speed that people like
    "--junctions.limit-turn-speed=2.5",
    "--junctions.internal-link-detail=12",
)


def _run(tool: str, *arguments: str) -> None:
    subprocess.run([str(TOOLS / tool), *arguments, "--junctions.corner-detail=0"], check=True)


def _keep(made: Path, name: str) -> None:
    """Compress without time stamps, so that the same network is the same file."""
    plain = re.sub(rb"<!--.*?-->\s*", b"", made.read_bytes(), flags=re.DOTALL)
    (HERE / name).write_bytes(gzip.compress(plain, mtime=0))


def main() -> None:
    """Write the three networks."""
    with tempfile.TemporaryDirectory() as folder:
        made, nodes, edges = (Path(folder) / name for name in ("made.net.xml", "f.nod.xml", "f.edg.xml"))
        places = range(FREEWAY_EDGES + 1)
        nodes.write_text(
            "<nodes>"
            + "".join(f'<node id="n{i}" x="{i * FREEWAY_EDGE_M}" y="0"/>' for i in places)
            + "</nodes>"
        )
        edges.write_text(
            "<edges>"
            + "".join(
                f'<edge id="e{i}" from="n{i}" to="n{i + 1}" numLanes="{FREEWAY_LANES}" speed="33.33"/>'
                for i in places[:-1]
            )
            + "</edges>"
        )
        _run("netconvert", f"--node-files={nodes}", f"--edge-files={edges}", f"--output-file={made}")
        _keep(made, "freeway.net.xml.gz")
        for number, name in ((10, "grid.net.xml.gz"), (20, "large_grid.net.xml.gz")):
            _run("netgenerate", *GRID, f"--grid.number={number}", f"--output-file={made}")
            _keep(made, name)


if __name__ == "__main__":
    main()
