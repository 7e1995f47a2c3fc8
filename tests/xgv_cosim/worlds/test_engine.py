"""Calls of SUMO's functions for many vehicles: libsumo's compiled ones where they do the same."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, wraps
from typing import Any

import pytest

from xgv_cosim.worlds.sumo.engine import direct, for_each, of_each
from xgv_cosim.worlds.sumo.libraries import load_libsumo

VEHICLE = load_libsumo().vehicle


@wraps(VEHICLE.setSpeed)
def logged(*given: Any) -> Any:
    return VEHICLE.setSpeed(*given)


@pytest.mark.parametrize("name", ["setSpeed", "setLateralLanePosition", "setPreviousSpeed", "getPosition"])
def test_what_only_hands_on_its_arguments_is_left_out(name: str) -> None:
    own = getattr(VEHICLE, name)
    assert direct(own) is not own
    assert direct(own).__name__ == f"vehicle_{name}"


@pytest.mark.parametrize("function", [VEHICLE.getLeader, logged, print, partial(print), str.upper])
def test_what_does_more_or_is_not_libsumos_stays(function: Callable[..., Any]) -> None:
    assert direct(function) is function


def test_rows_are_called_in_order() -> None:
    said: list[tuple[str, int]] = []
    for_each(lambda name, number: said.append((name, number)), ["a", "b"], [1, 2])
    assert said == [("a", 1), ("b", 2)]
    assert of_each(str.upper, ["a", "b"]) == ["A", "B"]
