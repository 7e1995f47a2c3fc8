from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

import xgv_cosim
from xgv_cosim.simulation import Simulation

Opener = Callable[..., Simulation]


@pytest.fixture
def open_hello() -> Iterator[Opener]:
    """Open scenario hello without its own injections and expectations, closed when the test ends."""
    with ExitStack() as stack:

        def opened(*overrides: str) -> Simulation:
            chosen = ["injections=[]", "expect=[]", *overrides]
            return stack.enter_context(xgv_cosim.simulate("hello", set=chosen))

        yield opened
