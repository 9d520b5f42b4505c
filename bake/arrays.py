"""Names for the array types that the engine passes around."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float64Array = NDArray[np.float64]
Float32Array = NDArray[np.float32]
Int64Array = NDArray[np.int64]
Int32Array = NDArray[np.int32]
UInt32Array = NDArray[np.uint32]
UInt16Array = NDArray[np.uint16]
UInt8Array = NDArray[np.uint8]
BoolArray = NDArray[np.bool_]
