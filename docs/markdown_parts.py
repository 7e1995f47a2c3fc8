"""Markdown from values: tables, code, and what a source file says about a name."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterable, Sequence
from types import ModuleType


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table.

    Raises:
        ValueError: A row has another number of cells than the header.
    """
    lines = [list(header), ["---"] * len(header)]
    for row in rows:
        if len(row) != len(header):
            raise ValueError(f"table row: got {len(row)} cells {row!r}, expected {len(header)}")
        lines.append([cell.replace("|", "\\|").replace("\n", " ") for cell in row])
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def mermaid(lines: Iterable[str]) -> str:
    """Return a diagram that GitHub and most Markdown viewers draw."""
    return "\n".join(["```mermaid", *lines, "```"])


def words(text: str) -> str:
    """Return a docstring as one line of Markdown: single back quotes, no closing full stop."""
    one_line = " ".join(text.split()).replace("``", "`")
    return re.sub(r"(?<!\.)\.$", "", one_line)


def rules_in(text: str) -> tuple[str, str]:
    """Return the text without its rule ids in brackets, and these ids."""
    found = re.search(r"\s*\(((?:(?:[A-Z]+-)?\d+|to|and|,|;|\s)+)\)", text)
    if found is None or "-" not in found[1]:
        return text, ""
    return text[: found.start()] + text[found.end() :], found[1]


def member_docs(module: ModuleType, class_name: str) -> dict[str, str]:
    """Return the docstring below each attribute of a class, empty for one that has none.

    Python throws these strings away, so they are read from the module's source.
    """
    for node in ast.parse(inspect.getsource(module)).body:
        if isinstance(node, ast.ClassDef) and node.name == class_name:
            return _docs_of(node.body)
    raise ValueError(f"{module.__name__} has no class {class_name}")


def _docs_of(body: list[ast.stmt]) -> dict[str, str]:
    docs: dict[str, str] = {}
    for statement, following in zip(body, [*body[1:], ast.Pass()], strict=True):
        if isinstance(statement, ast.Assign):
            target = statement.targets[0]
        elif isinstance(statement, ast.AnnAssign):
            target = statement.target
        else:
            continue
        if not isinstance(target, ast.Name):
            continue
        says = isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant)
        docs[target.id] = words(str(following.value.value)) if says else ""  # type: ignore[attr-defined]
    return docs
