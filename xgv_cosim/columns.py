"""Column types: one value per slot of the fleet, or per vehicle of a snapshot, shape ``(n,)``."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatColumn = npt.NDArray[np.float64]
IntColumn = npt.NDArray[np.int64]
UInt8Column = npt.NDArray[np.uint8]
UInt64Column = npt.NDArray[np.uint64]
UInt16Column = npt.NDArray[np.uint16]
BoolColumn = npt.NDArray[np.bool_]

BoolMatrix = npt.NDArray[np.bool_]
"""Shape ``(k, n)``."""
FloatMatrix = npt.NDArray[np.float64]
"""Shape ``(n, k)``."""
IntMatrix = npt.NDArray[np.int64]
"""Shape ``(n, k)``."""
UInt8Matrix = npt.NDArray[np.uint8]
"""Shape ``(n, k)``."""
WordMatrix = npt.NDArray[np.int64]
"""Words of bits, shape ``(k, n)``."""
FloatBlock = npt.NDArray[np.float64]
"""Shape ``(j, k, n)``."""
