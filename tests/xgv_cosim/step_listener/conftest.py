"""Fixtures of scripts that run SUMO themselves."""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType

import pytest

import xgv_cosim
from xgv_cosim.worlds.sumo.libraries import load_libsumo


@pytest.fixture
def libsumo() -> Iterator[ModuleType]:
    """The module, closed at the end whatever the script did."""
    module = load_libsumo()
    yield module
    if module.isLoaded():
        module.close()


@pytest.fixture
def attached(libsumo: ModuleType) -> Iterator[xgv_cosim.Plugin]:
    """A plugin attached to libsumo before it starts."""
    with xgv_cosim.attach(libsumo) as plugin:
        yield plugin
