"""Typed doors to numba, so that numeric code stays plain Python to readers, tests and mypy."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

from numba.extending import register_jitable

Function = TypeVar("Function", bound=Callable[..., object])


def inlinable(function: Function) -> Function:
    """Mark a scalar function as callable from the compiled kernel.

    Called from Python it stays the plain function: that is the oracle of the tests.
    """
    return cast("Function", register_jitable(function))
