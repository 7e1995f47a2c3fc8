"""Small faults, one at a time, planted into the syntax tree of a module.

Families of faults: comparison, boolean, arithmetic and bitwise operators, constants, enumeration members,
entries of literal sets and dictionaries, returned values, conditions, removed statements.
Annotations, decorators, docstrings and texts stay as they are: they decide nothing.
"""

from __future__ import annotations

import ast
import copy
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import EnumType
from typing import Any

_COMPARISONS: Mapping[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),  # codespell:ignore notin
    ast.NotIn: (ast.In,),  # codespell:ignore notin
}
_OPERATORS: Mapping[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
}
_REMOVABLE = (ast.Assign, ast.AnnAssign, ast.AugAssign, ast.Expr, ast.If, ast.For, ast.While, ast.Raise)
_UNTOUCHED_FIELDS = {"annotation", "returns", "decorator_list"}


@dataclass(frozen=True, slots=True)
class Mutant:
    """One fault."""

    name: str
    """Where and what, for example ``resolve_ready_mode: a is b -> a is not b``; stable when lines move."""
    source: str
    """Source of the whole module with the fault."""


def mutants_of(source: str, enums: Mapping[str, EnumType] | None = None) -> list[Mutant]:
    """Return every mutant of a module, in the order of its source.

    Args:
        source: The module's source.
        enums: Enumerations by the name under which the module knows them; a member becomes the next one.
    """
    tree = ast.parse(source)
    found: list[Mutant] = []
    seen: Counter[str] = Counter()
    for scope, parent, field, index, node in _places(tree, "module", in_function=False):
        for replacement in _replacements(node, enums or {}, removable=scope.endswith("()")):
            name = f"{scope}: {_short(node)} -> {_short(replacement)}"
            seen[name] += 1
            numbered = name if seen[name] == 1 else f"{name} #{seen[name]}"
            found.append(Mutant(numbered, _planted(tree, parent, field, index, replacement)))
    return found


def _short(node: ast.AST) -> str:
    text = " ".join(ast.unparse(ast.fix_missing_locations(copy.deepcopy(node))).split())
    return text if len(text) <= 90 else f"{text[:60]} ... {text[-25:]}"


def _places(
    node: ast.AST, scope: str, *, in_function: bool
) -> Iterator[tuple[str, ast.AST, str, int | None, ast.AST]]:
    """Yield every node that may be replaced, with where it hangs."""
    for field, value in ast.iter_fields(node):
        if field in _UNTOUCHED_FIELDS:
            continue
        children = enumerate(value) if isinstance(value, list) else [(None, value)]
        for index, child in children:
            if not isinstance(child, ast.AST) or _is_text(child):
                continue
            yield (f"{scope}()" if in_function else scope), node, field, index, child
            inner, inside = scope, in_function
            key = node.keys[index] if isinstance(node, ast.Dict) and index is not None else None
            if field == "values" and key is not None:
                inner = f"{scope}[{_short(key)}]"  # which entry of a table
            elif not in_function and (name := _name_of(child)):
                inner = name if scope == "module" else f"{scope}.{name}"
                inside = isinstance(child, ast.FunctionDef)
            yield from _places(child, inner, in_function=inside)


def _name_of(node: ast.AST) -> str:
    """Return the name that a statement defines, empty for other nodes."""
    match node:
        case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
            return name
        case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
            return name
    return ""


def _is_text(node: ast.AST) -> bool:
    constant = node.value if isinstance(node, ast.Expr) else node
    return isinstance(constant, ast.JoinedStr) or (
        isinstance(constant, ast.Constant) and isinstance(constant.value, str)
    )


def _planted(tree: ast.Module, parent: ast.AST, field: str, index: int | None, replacement: ast.AST) -> str:
    """Return the source with the replacement; the tree is as before afterwards."""
    value = getattr(parent, field)
    if index is None:
        setattr(parent, field, replacement)
    else:
        before, value[index] = value[index], replacement
    try:
        return ast.unparse(ast.fix_missing_locations(tree))
    finally:
        if index is None:
            setattr(parent, field, value)
        else:
            value[index] = before


def _replacements(node: ast.AST, enums: Mapping[str, EnumType], *, removable: bool) -> Iterator[ast.AST]:
    yield from _other_operators(node)
    yield from _other_values(node, enums)
    match node:
        case ast.If() | ast.IfExp():
            yield _with(node, test=ast.UnaryOp(ast.Not(), node.test))
        case ast.Return(value=ast.AST() as value) if not (
            isinstance(value, ast.Constant) and value.value is None
        ):
            yield ast.Return(ast.Constant(None))
    if removable and isinstance(node, _REMOVABLE):
        yield ast.Pass()


def _other_operators(node: ast.AST) -> Iterator[ast.AST]:
    match node:
        case ast.Compare():
            for place, operator in enumerate(node.ops):
                for other in _COMPARISONS[type(operator)]:
                    yield _with(node, ops=[*node.ops[:place], other(), *node.ops[place + 1 :]])
        case ast.BoolOp():
            yield _with(node, op=ast.Or() if isinstance(node.op, ast.And) else ast.And())
            for rest in _each_left_out(node.values):
                yield rest[0] if len(rest) == 1 else _with(node, values=rest)
        case ast.UnaryOp(op=ast.Not() | ast.Invert() | ast.USub()):
            yield node.operand
        case ast.BinOp() if type(node.op) in _OPERATORS:
            yield _with(node, op=_OPERATORS[type(node.op)]())


def _other_values(node: ast.AST, enums: Mapping[str, EnumType]) -> Iterator[ast.AST]:
    match node:
        case ast.Constant(value=bool(value)):
            yield ast.Constant(not value)
        case ast.Constant(value=int(value) | float(value)):
            yield ast.Constant(value + 1)
        case ast.Attribute(value=ast.Name(id=kind), attr=member) if kind in enums:
            names = [*enums[kind].__members__]
            if member in names:
                yield _with(node, attr=names[(names.index(member) + 1) % len(names)])
        case ast.Set(elts=elements) if len(elements) > 1:
            for rest in _each_left_out(elements):
                yield ast.Set(rest)
        case ast.Dict(keys=keys, values=values) if len(keys) > 1:
            for some_keys, some_values in zip(_each_left_out(keys), _each_left_out(values), strict=True):
                yield ast.Dict(some_keys, some_values)


def _each_left_out(items: list[Any]) -> Iterator[list[Any]]:
    for place in range(len(items)):
        yield [*items[:place], *items[place + 1 :]]


def _with(node: ast.AST, **changes: object) -> ast.AST:
    changed = copy.copy(node)
    for field, value in changes.items():
        setattr(changed, field, value)
    return changed
