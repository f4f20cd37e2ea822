"""Disjoint sets in one array: parent[i] <= i, a root being its own parent."""

from __future__ import annotations

import numpy as np

from porefv.system.kernels import helper


@helper
def join(parent: np.ndarray, i: int, j: int) -> None:
    """Put i and j in one set, under the smaller of their roots; the paths passed are halved."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    while parent[j] != j:
        parent[j] = parent[parent[j]]
        j = parent[j]
    parent[max(i, j)] = min(i, j)
