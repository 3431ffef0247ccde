"""Linear equations in kernels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactful._njit import njit

Array = NDArray[np.float64]


@njit(cache=True)
def solve_positive(A: Array, b: Array) -> None:
    """Set b to A^-1 b for a symmetric, positive definite A (m, m), by its Cholesky factor, which replaces A."""
    m = A.shape[0]
    for i in range(m):
        for j in range(i + 1):
            total = A[i, j]
            for k in range(j):
                total -= A[i, k] * A[j, k]
            A[i, j] = np.sqrt(total) if i == j else total / A[j, j]
        for k in range(i):
            b[i] -= A[i, k] * b[k]
        b[i] /= A[i, i]
    for i in range(m - 1, -1, -1):
        for k in range(i + 1, m):
            b[i] -= A[k, i] * b[k]
        b[i] /= A[i, i]
