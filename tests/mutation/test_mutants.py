"""The planting of faults itself, on a few lines."""

from __future__ import annotations

import ast
from enum import IntEnum
from pathlib import Path

import pytest

from tests.mutation.mutants import Mutant, mutants_of
from tests.mutation.running import ROOT, survivors


class Colour(IntEnum):
    RED = 0
    BLUE = 1


def faults_of(source: str) -> dict[str, str]:
    return {mutant.name: mutant.source for mutant in mutants_of(source, {"Colour": Colour})}


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("x = a < b", {"x = a <= b", "x = a >= b"}),
        ("x = a is None", {"x = a is not None"}),
        ("x = a and b and c", {"x = a or b or c", "x = b and c", "x = a and c", "x = a and b"}),
        ("x = not a", {"x = a"}),
        ("x = a & b << 1", {"x = a | b << 1", "x = a & b >> 1", "x = a & b << 2"}),
        ("x = True", {"x = False"}),
        ("x = Colour.BLUE", {"x = Colour.RED"}),
        ("x = Colour.name", set()),
        ("x = {a, b}", {"x = {b}", "x = {a}"}),
        ("x = {a: b, c: d}", {"x = {c: d}", "x = {a: b}"}),
        ("x: A | B = 'text'", set()),
        ("x = a if b else c", {"x = a if not b else c"}),
    ],
)
def test_each_family_of_faults(line: str, expected: set[str]) -> None:
    assert set(faults_of(line).values()) == expected


def test_statements_are_removed_and_values_not_returned_in_functions_only() -> None:
    source = '''
x = a
def f() -> int | None:
    """Text."""
    g()
    return h
'''
    faults = faults_of(source)
    assert list(faults) == ["f(): g() -> pass", "f(): return h -> return None"]
    for fault in faults.values():
        ast.parse(fault)


def test_equal_faults_in_one_function_are_numbered() -> None:
    names = [*faults_of("def f():\n    return a == b, a == b\n")]
    assert names[1:] == ["f(): a == b -> a != b", "f(): a == b -> a != b #2"]


def test_each_fault_is_alone() -> None:
    source = "def f(a, b):\n    return a + b - 1\n"
    for fault in faults_of(source).values():
        assert fault != source
        assert sum(one != other for one, other in zip(fault.split(), source.split(), strict=False)) <= 2


@pytest.mark.slow
def test_a_mutant_whose_tests_take_long_is_tried_again_with_more_time(tmp_path: Path) -> None:
    """Else a survivor would be hidden by a limit that is too short for it."""
    module, test = tmp_path / "planted_slow.py", tmp_path / "test_planted_slow.py"
    module.write_text("def f():\n    pass\n")
    test.write_text(
        "import sys\n"
        f"sys.path.insert(0, {str(tmp_path)!r})\n"
        "from planted_slow import f\n"
        "def test_f():\n    f()\n"
    )
    busy = (
        "import time\ndef f():\n"
        "    end_s = time.process_time() + {}\n"
        "    while time.process_time() < end_s:\n        pass\n"
    )
    mutants = [Mutant("long", busy.format(4)), Mutant("endless", busy.format(1000))]
    alive = survivors("planted_slow", str(module), mutants, [str(test)], tmp_path, limit_s=3)
    assert alive == {"long"}


@pytest.mark.slow
def test_a_fault_that_no_test_sees_survives_and_a_crash_or_an_endless_loop_does_not(tmp_path: Path) -> None:
    """The worker on a module and a test that are made here."""
    module, test = tmp_path / "planted_module.py", tmp_path / "test_planted.py"
    module.write_text("def f(a):\n    return a > 1\n")
    test.write_text(
        "import sys\n"
        f"sys.path.insert(0, {str(tmp_path)!r})\n"
        "from planted_module import f\n"
        "def test_f():\n    assert f(2) and not f(0)\n"
    )
    sources = {
        "unseen": "def f(a):\n    return a >= 1\n",
        "seen": "def f(a):\n    return a < 1\n",
        "crash": "def f(a):\n    return g\n",
        "no module": "raise ImportError\n",
        "endless": "def f(a):\n    while True:\n        pass\n",
    }
    mutants = [Mutant(name, source) for name, source in sources.items()]
    alive = survivors("planted_module", str(module), mutants, [str(test)], tmp_path, limit_s=3)
    assert alive == {"unseen"}
    test.write_text(f"{test.read_text()}    assert f(1)\n")
    with pytest.raises(RuntimeError, match="fail without any fault"):
        survivors("planted_module", str(module), mutants, [str(test)], tmp_path)
    assert ROOT not in module.parents
