"""The part of a ball within an orthoscheme, a tetrahedron with right angles: closed form."""

from __future__ import annotations

import numpy as np

from porefv.system.kernels import helper


@helper(error_model="numpy")
def ball_in_orthoscheme(r, d1, d2, d3):
    """Volume, spherical surface, and area in the face at F_1 of a ball within an orthoscheme at its centre.

    Its vertices are 0, F_1 = (d1, 0, 0), F_2 = (d1, d2, 0) and P = (d1, d2, d3); d1, d2 and d3 are not negative. The
    ball is a cone over the disc in the face, and a spherical part over the rest of the solid angle.
    """
    r2 = np.sqrt(d1 * d1 + d2 * d2)
    r3 = np.sqrt(d1 * d1 + d2 * d2 + d3 * d3)
    if r >= r3:
        return d1 * d2 * d3 / 6.0, 0.0, 0.5 * d2 * d3
    omega = 2.0 * np.arctan2(d2 * d3, (r2 + r3) * (r2 + d1))
    if r <= d1:
        return omega * r * r * r / 3.0, omega * r * r, 0.0
    disc = (r - d1) * (r + d1)
    angle = np.arctan2(d3, d2)
    area = hidden = 0.0
    if disc > d2 * d2:  # the disc reaches beyond the edge of the face: a triangle, and a sector
        half = np.sqrt(disc - d2 * d2)
        area = 0.5 * d2 * half
        hidden = 2.0 * np.arctan2(d2 * half, (r2 + r) * (r2 + d1))
        angle = max(angle - np.arctan2(half, d2), 0.0)
    area += 0.5 * angle * disc
    hidden += angle * (r - d1) / r
    return (omega - hidden) * r * r * r / 3.0 + d1 * area / 3.0, (omega - hidden) * r * r, area
