"""The files whose code is in the machine code, by which its cache on disk is named."""

from __future__ import annotations

from pathlib import Path


def kernel_sources() -> list[Path]:
    """Return every file whose code the compiled loop contains."""
    package = Path(__file__).parent.parent
    names = ("jit", "fleet_columns", "parameters", "actuation", "clock", "commands")
    modules = [package / f"{name}.py" for name in names]
    folders = ("controllers", "kernel", "plant")
    return modules + [path for folder in folders for path in sorted((package / folder).glob("*.py"))]
