"""Fixtures of the tests of worlds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import pytest

from tests.xgv_cosim.worlds.sumo_traffic import network, write_config
from xgv_cosim.worlds.sumo.world import SumoWorld

if TYPE_CHECKING:
    from pathlib import Path

NewWorld = Callable[..., SumoWorld]


@pytest.fixture
def sumo(tmp_path: Path) -> Iterator[NewWorld]:
    """Return a maker of worlds: ``sumo(vehicles, net="hello")``; they are closed at the end."""
    made: list[SumoWorld] = []

    def make(*vehicles: str, net: str = "hello", seed: int = 1, options: tuple[str, ...] = ()) -> SumoWorld:
        config = write_config(tmp_path, "".join(vehicles), network(net))
        made.append(SumoWorld.headless(config, step_s=0.1, seed=seed, options=options))
        return made[-1]

    yield make
    for world in made:
        world.close()
