"""Tests and sources name every rule of the XGV, and none that does not exist."""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[2]
SOURCES = [TESTS.parent / "xgv_cosim", TESTS.parent / "jaus"]
_LISTS = tomllib.loads(Path(__file__).with_name("xgv_rules.toml").read_text(encoding="utf-8"))
RULES: dict[str, str] = _LISTS["rules"]
EXCUSED: dict[str, str] = _LISTS["excused"]


def rules_named_in(source: str) -> dict[str, set[str]]:
    """Return the rule ids in names and docstrings of tests, each with the tests that name it."""
    named: dict[str, set[str]] = {}
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            ids = re.findall(r"xgv_(\d\d)(?!\d)", node.name)
            ids += re.findall(r"XGV-(\d\d)(?!\d)", ast.get_docstring(node) or "")
            for number in ids:
                named.setdefault(f"XGV-{number}", set()).add(node.name)
    return named


@pytest.fixture(scope="module")
def named() -> dict[str, set[str]]:
    every: dict[str, set[str]] = {}
    for path in sorted(TESTS.rglob("test_*.py")):
        for rule, tests in rules_named_in(path.read_text(encoding="utf-8")).items():
            every.setdefault(rule, set()).update(tests)
    return every


def test_names_and_docstrings_count_and_nothing_else() -> None:
    source = '''
def test_it_stops_xgv_33_xgv_36() -> None:
    """As XGV-12 says."""
    # XGV-01
    car = "xgv_01"
def helper_xgv_02() -> None:
    """XGV-03"""
'''
    assert rules_named_in(source) == {
        rule: {"test_it_stops_xgv_33_xgv_36"} for rule in ("XGV-33", "XGV-36", "XGV-12")
    }


@pytest.mark.parametrize("rule", [rule for rule in RULES if rule not in EXCUSED])
def test_a_test_names_the_rule(named: dict[str, set[str]], rule: str) -> None:
    assert rule in named, f"no test names {rule}: {RULES[rule]}"


@pytest.fixture(scope="module")
def implemented() -> set[str]:
    """Return the rules that a source file names, each spelled out ("XGV-22 to 24" names 22 alone)."""
    paths = [path for folder in SOURCES for path in folder.rglob("*.py")]
    return {rule for path in paths for rule in re.findall(r"XGV-\d\d(?!\d)", path.read_text("utf-8"))}


@pytest.mark.parametrize("rule", [rule for rule in RULES if rule not in EXCUSED])
def test_the_source_names_the_rule(implemented: set[str], rule: str) -> None:
    assert rule in implemented, f"no source file names {rule}: {RULES[rule]}"


def test_the_source_names_no_unknown_rule(implemented: set[str]) -> None:
    assert implemented - set(RULES) == set()


@pytest.mark.parametrize("rule", EXCUSED)
def test_an_excused_rule_is_named_by_no_test(named: dict[str, set[str]], rule: str) -> None:
    """An excuse that is no longer needed goes."""
    assert EXCUSED[rule]
    assert rule not in named, f"{rule} is excused, but {named[rule]} name it"


def test_no_test_names_an_unknown_rule(named: dict[str, set[str]]) -> None:
    assert set(named) - set(RULES) == set()


def test_the_list_is_complete() -> None:
    assert [*RULES] == [f"XGV-{number:02}" for number in range(1, 72)]
    assert set(EXCUSED) <= set(RULES)
