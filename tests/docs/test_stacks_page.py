"""``docs/stacks.md`` says what an observation holds, and which messages there are."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from typing import get_args

import pytest

from xgv_cosim.endpoint import StackMessage

DOCS = Path(__file__).parents[2] / "docs"
TEXT = (DOCS / "stacks.md").read_text()


def test_the_tables_are_those_of_the_code(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [str(DOCS), *sys.path])
    assert runpy.run_path(str(DOCS / "stack_tables.py"))["filled"](TEXT) == TEXT, (
        "out of date; run python docs/stack_tables.py"
    )


def test_every_message_is_named() -> None:
    assert [kind.__name__ for kind in get_args(StackMessage) if f"`{kind.__name__}" not in TEXT] == []
