"""Direct solution: sparse factors of symmetric positive definite matrices (SuperLU)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from porefv.errors import ComputationError
from porefv.solvers.conjugate_gradients import imbalance
from porefv.solvers.network import Network

if TYPE_CHECKING:
    from scipy import sparse


class SparseFactor:
    """Sparse factor of a symmetric positive definite matrix (SuperLU, minimum degree)."""

    def __init__(self, matrix: sparse.csr_array):
        from scipy import sparse
        from scipy.sparse.linalg import splu

        # Scaled to a unit diagonal: units and contrast then do not meet the factorisation's thresholds.
        self.scale = 1.0 / np.sqrt(matrix.diagonal())
        scale = sparse.diags_array(self.scale)
        scaled = (scale @ matrix @ scale).tocsc()
        try:
            self.factor = splu(
                scaled, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError:
            raise ComputationError(
                "the network is singular: a part of it is not joined to any imposed pressure"
            ) from None

    def apply(self, r: np.ndarray, z: np.ndarray) -> float:
        """z = A⁻¹ r but for rounding; returns r·z. The same as `ApproximateCholesky.apply`."""
        np.multiply(self.scale, self.factor.solve(self.scale * r), out=z)
        return float((r * z).sum())


class DirectFactor(SparseFactor):
    """Sparse factor of a network."""

    def __init__(self, network: Network):
        super().__init__(network.to_matrix())
        self.network = network

    def solve(self, rhs: np.ndarray, tolerance: float) -> tuple[np.ndarray, int]:
        """x (n,), refined until its imbalance is below the tolerance, and the number of refinements."""
        x = self.scale * self.factor.solve(self.scale * rhs)
        refinements = 0
        while refinements < 3:
            refinements += 1
            lost, flow, floor = imbalance(self.network, rhs, x)
            if lost <= max(tolerance * flow, floor):
                break
            x += self.scale * self.factor.solve(self.scale * self.network.residual(rhs, x))
        return x, refinements
