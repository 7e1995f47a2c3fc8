"""Networks that SUMO's own tools make for one test."""

from __future__ import annotations

import subprocess
from pathlib import Path

import sumo

TOOLS = Path(sumo.__file__).parent / "bin"
_EXACT = ("--precision", "6", "--offset.disable-normalization", "true")


def run_tool(name: str, *arguments: str) -> None:
    done = subprocess.run([TOOLS / name, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def signalised_grid(
    folder: Path, *options: str, number: int = 4, length_m: float = 150.0, lanes: int = 2
) -> Path:
    """Return a grid of streets with signals at every inner crossing; no car can turn round."""
    net = folder / "grid.net.xml"
    grid = ("--grid", "--grid.number", str(number), "--grid.length", str(length_m), "-L", str(lanes))
    signals = ("--tls.guess", "true", "--tls.guess.threshold", "1")
    run_tool("netgenerate", *grid, *signals, "--no-turnarounds", "--precision", "6", "-o", str(net), *options)
    return net


def plain_network(folder: Path, nodes: str, edges: str, *options: str, no_turnarounds: bool = True) -> Path:
    """Return a network of ``<node .../>`` and ``<edge .../>`` elements."""
    net = folder / "plain.net.xml"
    (folder / "p.nod.xml").write_text(f"<nodes>{nodes}</nodes>")
    (folder / "p.edg.xml").write_text(f"<edges>{edges}</edges>")
    files = ("-n", str(folder / "p.nod.xml"), "-e", str(folder / "p.edg.xml"), "-o", str(net))
    run_tool("netconvert", *files, "--no-turnarounds", str(no_turnarounds).lower(), *_EXACT, *options)
    return net
