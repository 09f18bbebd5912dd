"""From numpy to the tuples that messages hold."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike


def row_major(array: ArrayLike) -> tuple[Any, ...]:
    """The numbers of a vector or matrix, row by row, as Python floats: `covariance=row_major(np.eye(6))`."""
    return tuple(np.asarray(array, dtype=np.float64).ravel().tolist())
