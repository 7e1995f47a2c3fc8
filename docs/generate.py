"""Write the tables and diagrams of the documentation from the code, or check that they are up to date.

    python docs/generate.py            rewrite what stands between the markers of modes.md and jaus/README.md
    python docs/generate.py --check    exit with 1 and name the parts that are out of date

A part stands between ``<!-- generated: NAME -->`` and ``<!-- end of NAME -->``.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import jaus_messages
import xgv_device_table as devices
import xgv_diagrams as diagrams
import xgv_tables as tables

PAGE = Path(__file__).with_name("modes.md")

PARTS: Mapping[str, Callable[[], str]] = {
    "safety chain": diagrams.safety_chain,
    "causes": lambda: tables.modes_page(1),
    "safety devices": tables.safety_devices,
    "drivers": lambda: tables.modes_page(0),
    "holders": tables.holders,
    "situations": tables.situations,
    "axes": lambda: tables.modes_page(2),
    "control diagram": diagrams.component_control,
    "control messages": tables.control_messages,
    "status diagram": diagrams.component_status,
    "status commands": tables.status_commands,
    "permissions": tables.permissions,
    "devices moved": devices.devices_moved,
    "injections": tables.injections,
    "operator actions": tables.operator_actions,
    "rearm words": tables.rearm_words,
    "rearm": tables.rearm,
    "errors": tables.errors,
    "xgv keys": tables.xgv_keys,
    "safestop keys": tables.safestop_keys,
    "bind keys": tables.bind_keys,
    "assumptions": tables.assumptions,
    "wire codes": tables.wire_codes,
}
"""What each marker of modes.md stands for."""

PAGES: Mapping[Path, Mapping[str, Callable[[], str]]] = {
    PAGE: PARTS,
    PAGE.parents[1] / "jaus" / "README.md": {"messages": jaus_messages.messages},
}

_PART = re.compile(r"<!-- generated: (?P<name>[^>]+) -->\n(?P<body>.*?)<!-- end of (?P=name) -->", re.DOTALL)


def filled(page: str, parts: Mapping[str, Callable[[], str]] = PARTS) -> tuple[str, list[str]]:
    """Return the page with every part anew, and the names of those that were out of date.

    Raises:
        ValueError: A marker names no part, or a part has no marker.
    """
    found = [match["name"] for match in _PART.finditer(page)]
    if sorted(found) != sorted(parts) or page.count("<!-- generated: ") != len(found):
        raise ValueError(
            f"markers: got {sorted(found)}, expected each of {sorted(parts)} once, opened and closed"
        )
    stale: list[str] = []

    def renewed(match: re.Match[str]) -> str:
        name = match["name"]
        body = f"\n{parts[name]()}\n\n"
        if match["body"] != body:
            stale.append(name)
        return f"<!-- generated: {name} -->\n{body}<!-- end of {name} -->"

    return _PART.sub(renewed, page), stale


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; return the exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="change nothing; exit with 1 if out of date")
    parser.add_argument("page", nargs="?", type=Path, help="a copy of modes.md, by default all pages")
    options = parser.parse_args(arguments)
    pages = PAGES if options.page is None else {options.page: PARTS}
    return max(_written(page, parts, check=options.check) for page, parts in pages.items())


def _written(path: Path, parts: Mapping[str, Callable[[], str]], *, check: bool) -> int:
    """Write a page, or only tell what is out of date; return the exit code."""
    try:
        page, stale = filled(path.read_text(encoding="utf-8"), parts)
    except ValueError as error:
        sys.stderr.write(f"{path.name}: {error}\n")
        return 2
    if check:
        for name in stale:
            sys.stderr.write(f"{path.name}: '{name}' is out of date; run python docs/generate.py\n")
        return 1 if stale else 0
    if stale:
        path.write_text(page, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
