"""Pairs of numbers for a stack: tuples for whoever walks along them, a matrix for numpy."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, overload

import numpy as np

if TYPE_CHECKING:
    from xgv_cosim.columns import FloatMatrix

Pair = tuple[float, float]


class Points(Sequence[Pair]):
    """A sequence of pairs that are made when somebody asks for them; ``np.asarray`` takes them as they are.

    Equal to any sequence of the same pairs.

    Args:
        matrix: Shape ``(n, 2)``; nobody may write to it afterwards.
    """

    __slots__ = ("_made", "_matrix")

    def __init__(self, matrix: FloatMatrix) -> None:
        self._matrix = matrix
        self._made: tuple[Pair, ...] | None = None

    @property
    def _pairs(self) -> tuple[Pair, ...]:
        if self._made is None:
            self._made = tuple([(first, second) for first, second in self._matrix.tolist()])
        return self._made

    def __len__(self) -> int:
        return len(self._matrix)

    @overload
    def __getitem__(self, index: int) -> Pair: ...

    @overload
    def __getitem__(self, index: slice) -> Points: ...

    def __getitem__(self, index: int | slice) -> Pair | Points:
        if isinstance(index, slice):
            return Points(self._matrix[index])
        return self._pairs[index]

    def __iter__(self) -> Iterator[Pair]:
        return iter(self._pairs)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> FloatMatrix:  # noqa: ANN401 - numpy's
        """Return the matrix, shape ``(n, 2)``; read-only unless copied."""
        matrix: FloatMatrix = np.array(self._matrix, dtype, copy=copy)
        if not copy:
            matrix = matrix.view()
            matrix.flags.writeable = False
        return matrix

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Sequence):
            return self._pairs == tuple(other)
        return NotImplemented

    __hash__ = None  # type: ignore[assignment] # equal to lists, which have none

    def __repr__(self) -> str:
        return repr(self._pairs)
