"""Types of NumPy arrays, shared by all modules; docstrings give each array's shape and unit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Numbers in double precision."""

IntArray = NDArray[np.int_]
"""Indices, counts and labels."""

BoolArray = NDArray[np.bool_]
"""Masks."""
