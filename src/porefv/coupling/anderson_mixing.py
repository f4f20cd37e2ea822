"""AndersonMixing: where the next round of a fixed-point iteration x = F(x) starts (Anderson 1965).

Of a linear F it is as good as GMRES: what stiff modes need in plain rounds grows with their stiffness.
"""

from __future__ import annotations

import numpy as np


class AndersonMixing:
    """Extrapolates rounds: the next one starts from the combination of the last ones whose change would be least.

    Parameters
    ----------
    kept : int
        Number of rounds that are combined.
    """

    def __init__(self, kept: int):
        self._kept = kept
        self._results: list[np.ndarray] = []
        self._changes: list[np.ndarray] = []

    def next(self, start: np.ndarray, result: np.ndarray) -> np.ndarray:
        """The start of the next round, after one that has led from `start` to `result`, both (n,)."""
        self._results = [*self._results[1 - self._kept :], result]
        self._changes = [*self._changes[1 - self._kept :], result - start]
        if len(self._changes) == 1:
            return result
        steps, moves = np.diff(self._changes, axis=0), np.diff(self._results, axis=0)
        parts = np.linalg.lstsq(steps.T, self._changes[-1], rcond=1e-10)[0]
        return result - parts @ moves
