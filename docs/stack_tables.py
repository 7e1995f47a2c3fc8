"""Write the tables of what a stack sees into stacks.md, from the docstrings of the observation.

python docs/stack_tables.py
"""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from types import ModuleType

from markdown_parts import member_docs, table

from xgv_cosim import observation, surroundings

PAGE = Path(__file__).with_name("stacks.md")
MARK = "<!-- observation -->"
PARTS: tuple[tuple[ModuleType, str], ...] = (
    (observation, "Observation"),
    (observation, "LaneBeside"),
    (surroundings, "Signal"),
    (surroundings, "Junction"),
    (surroundings, "Foe"),
    (observation, "DeviceReading"),
)


def observation_tables() -> str:
    """Return one table for each part of the observation."""
    parts = []
    for module, name in PARTS:
        says = member_docs(module, name)
        rows = [
            (f"`{field.name}`", f"`{field.type}`", says[field.name]) for field in fields(vars(module)[name])
        ]
        parts.append(f"### {name}\n\n{table(('field', 'type', 'meaning'), rows)}\n")
    return "\n".join(parts)


def filled(page: str) -> str:
    """Return the page with the tables anew behind the marker."""
    head, mark, _ = page.partition(MARK)
    return f"{head}{mark}\n\n{observation_tables()}"


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
