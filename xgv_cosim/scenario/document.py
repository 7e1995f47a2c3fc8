"""A YAML text as plain data in which every key and every value knows its line and column.

YAML 1.2, so that ``no``, ``off`` and ``none`` are words and ``07:30`` is no number.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.constructor import ConstructorError
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from xgv_cosim.scenario.problems import Path, Problem, dotted

_MERGE_TAG = "tag:yaml.org,2002:merge"


@dataclass(slots=True)
class Document:
    """A YAML text read into plain mappings, lists and scalars."""

    name: str
    """What messages call the file."""
    data: Any = None
    key_at: dict[Path, tuple[int, int]] = field(default_factory=dict)
    """Line and column of the key (or of the list entry) of each path, both counted from 1."""
    value_at: dict[Path, tuple[int, int]] = field(default_factory=dict)
    """Line and column of the value of each path, both counted from 1."""
    problems: list[Problem] = field(default_factory=list)
    """Syntax errors, duplicate keys and values that YAML cannot read."""

    def place_of_key(self, path: Path) -> str:
        """Return ``file:line:column`` of the key at ``path``, or of what stands nearest above it."""
        return self._place(path, self.key_at)

    def place_of_value(self, path: Path) -> str:
        """Return ``file:line:column`` of the value at ``path``, or of what stands nearest above it."""
        return self._place(path, self.value_at)

    def _place(self, path: Path, positions: dict[Path, tuple[int, int]]) -> str:
        if path in positions:
            line, column = positions[path]
            return f"{self.name}:{line}:{column}"
        for length in range(len(path) - 1, -1, -1):
            if path[:length] in self.value_at:
                line, column = self.value_at[path[:length]]
                return f"{self.name}:{line}:{column}"
        return self.name


def parse_scalar(text: str) -> Any:  # noqa: ANN401 - a YAML value has any type
    """Return the value of a short YAML text, as ``--set`` takes it.

    Raises:
        YAMLError: The text is not YAML.
    """
    return YAML(typ="safe", pure=True).load(text)


def read_document(text: str, name: str) -> Document:
    """Read a YAML text; what is wrong with it stands in ``problems`` of the result."""
    document = Document(name)
    yaml = YAML(typ="safe", pure=True)
    try:
        root = yaml.compose(text)
    except MarkedYAMLError as error:
        document.problems.append(_syntax_problem(error, name))
        return document
    except YAMLError as error:  # a character that YAML does not allow; it has no mark
        document.problems.append(Problem(f"not valid YAML: {_one_line(str(error))}", place=name))
        return document
    if root is not None:
        document.data = _Reader(document, yaml).value(root, ())
    return document


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _syntax_problem(error: MarkedYAMLError, name: str) -> Problem:
    mark = error.problem_mark or error.context_mark
    place = f"{name}:{mark.line + 1}:{mark.column + 1}" if mark else name
    text = ", ".join(_one_line(part) for part in (error.context, error.problem) if part)
    hint = "use spaces, not tabs" if "\\t" in text else ""
    return Problem(f"not valid YAML: {text}", place=place, hint=hint)


class _Reader:
    """Turns nodes into plain data and notes where they stand."""

    def __init__(self, document: Document, yaml: YAML) -> None:
        self._document = document
        self._yaml = yaml
        self._open: list[Node] = []

    def value(self, node: Node, path: Path) -> Any:  # noqa: ANN401 - a YAML value has any type
        self._document.value_at[path] = (node.start_mark.line + 1, node.start_mark.column + 1)
        if any(node is parent for parent in self._open):
            self._complain("an alias that contains itself", path)
            return None
        self._open.append(node)
        try:
            if isinstance(node, MappingNode):
                return self._mapping(node, path)
            if isinstance(node, SequenceNode):
                return [self._entry(child, (*path, index)) for index, child in enumerate(node.value)]
            if isinstance(node, ScalarNode):
                return self._scalar(node, path)
            raise AssertionError(f"unknown kind of YAML node {node!r}")
        finally:
            self._open.pop()

    def _entry(self, node: Node, path: Path) -> Any:  # noqa: ANN401 - a YAML value has any type
        self._document.key_at[path] = (node.start_mark.line + 1, node.start_mark.column + 1)
        return self.value(node, path)

    def _scalar(self, node: ScalarNode, path: Path) -> Any:  # noqa: ANN401 - a YAML value has any type
        try:
            return self._yaml.constructor.construct_object(node, deep=True)
        except (ConstructorError, ValueError) as error:
            reason = error.problem if isinstance(error, ConstructorError) else str(error)
            self._complain(f"cannot read {node.value!r}: {_one_line(str(reason))}", path)
            return None

    def _mapping(self, node: MappingNode, path: Path) -> dict[str, Any]:
        result: dict[str, Any] = {}
        merged: dict[str, Any] = {}
        for key_node, value_node in sorted(node.value, key=lambda pair: pair[0].tag != _MERGE_TAG):
            if key_node.tag == _MERGE_TAG:
                merged.update(self._merge(value_node, path))
                continue
            if not isinstance(key_node, ScalarNode):
                self._complain("a key must be a word, not a list or a mapping", path)
                continue
            key = str(key_node.value)
            here = (*path, key)
            if key in result:
                line, column = key_node.start_mark.line + 1, key_node.start_mark.column + 1
                first_line = self._document.key_at[here][0]
                self._document.problems.append(
                    Problem(
                        f"this key stands in line {first_line} already; keep one of the two",
                        dotted(here),
                        f"{self._document.name}:{line}:{column}",
                    )
                )
                continue
            self._document.key_at[here] = (key_node.start_mark.line + 1, key_node.start_mark.column + 1)
            result[key] = self.value(value_node, here)
        return merged | result

    def _merge(self, node: Node, path: Path) -> dict[str, Any]:
        """Return the entries that ``<<: *alias`` brings in; the first of several aliases wins."""
        sources = node.value if isinstance(node, SequenceNode) else [node]
        result: dict[str, Any] = {}
        for source in sources:
            if not isinstance(source, MappingNode):
                self._complain("'<<' takes a mapping or a list of mappings", path)
                continue
            for key, value in self._mapping(source, path).items():
                result.setdefault(key, value)
        return result

    def _complain(self, message: str, path: Path) -> None:
        place = self._document.place_of_value(path)
        self._document.problems.append(Problem(message, dotted(path), place))
