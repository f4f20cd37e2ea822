"""The fluid around the spheres as a solid body for the mesher, contacts regularised.

Two spheres that touch leave a cusp that no mesh can fill. It is closed off in one of two ways, which bracket the flow:

caps
    each sphere is flattened, so that a plane gap of 2 δ r is left at the contact (δ r to a wall): fluid is added;
bridges
    a cylinder of radius δ r joins the two: fluid is taken away.

r is the radius of the smaller sphere. What they do to the flow fades as δ^1.5 and δ^2: see `REGULARISATIONS`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from porefv.packing.box import WALL_AXES, WALL_NORMALS, WALL_SENSES, Box

if TYPE_CHECKING:
    from netgen.csg import CSGeometry

# Exponent of δ with which each regularisation fades.
REGULARISATIONS = {"caps": 1.5, "bridges": 2.0}
# Overlaps of more than this part of the smaller radius are necks of cemented grains, and stay as they are.
CEMENTED = 0.02


@dataclass(frozen=True)
class Contact:
    """A place where a sphere touches a sphere or a wall, or nearly so.

    Attributes
    ----------
    sphere, other : int
        Sphere, and the other sphere, or n + w for wall w (0 ... 5: x_min, x_max, y_min, ...).
    point : (3,) array
        The middle of the gap or of the overlap; on the wall.
    normal : (3,) array
        Unit vector from the sphere to the other.
    radius : float
        That of the smaller sphere.
    depth : float
        Overlap, negative for a gap.
    """

    sphere: int
    other: int
    point: np.ndarray
    normal: np.ndarray
    radius: float
    depth: float


def contacts(
    centres: np.ndarray, radii: np.ndarray, lower: np.ndarray, upper: np.ndarray, delta: float
) -> list[Contact]:
    """Contacts to regularise: gaps narrower than 2 δ r (δ r to a wall), overlaps up to `CEMENTED`.

    Parameters
    ----------
    centres, radii : (n, 3), (n,) float arrays
        Of the spheres, in any unit of length.
    lower, upper : (3,) float arrays
        Corners of the box, in the same unit.
    delta : float
        δ, over the radius of the smaller sphere.

    Returns
    -------
    list of Contact
        Lengths in the unit of the arguments.
    """
    n = len(radii)
    places = Box(lower, upper).wall_places
    found = []
    for i in range(n):
        vectors = centres[i + 1 :] - centres[i]
        distances = np.linalg.norm(vectors, axis=1)
        smaller = np.minimum(radii[i], radii[i + 1 :])
        depths = radii[i] + radii[i + 1 :] - distances
        for k in np.flatnonzero((depths > -2.0 * delta * smaller) & (depths < CEMENTED * smaller)):
            normal = vectors[k] / distances[k]
            point = centres[i] + (radii[i] - 0.5 * depths[k]) * normal
            found.append(Contact(i, i + 1 + int(k), point, normal, float(smaller[k]), float(depths[k])))
        for wall in range(6):
            axis, sense = WALL_AXES[wall], WALL_SENSES[wall]
            height = sense * (places[wall] - centres[i, axis])
            depth = radii[i] - height
            if -delta * radii[i] < depth < CEMENTED * radii[i]:
                normal = WALL_NORMALS[wall]
                point = centres[i] + height * normal
                found.append(Contact(i, n + wall, point, normal, float(radii[i]), float(depth)))
    return found


def fluid_body(
    centres: np.ndarray,
    radii: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    *,
    delta: float,
    regularisation: str,
    mesh_size: float,
) -> CSGeometry:
    """The box less its spheres, surfaces named `wall0` ... `wall5` and `solid`.

    Parameters
    ----------
    centres, radii, lower, upper, delta
        As for `contacts`. Spheres may reach beyond the box, which cuts them.
    regularisation : {'caps', 'bridges'}
        What closes off the contacts: see the module.
    mesh_size : float
        Largest size of elements on a sphere, over its radius.
    """
    from netgen.csg import CSGeometry, Pnt, Sphere

    n = len(radii)
    body = _box(lower, upper)
    touching = contacts(centres, radii, lower, upper, delta)
    flats: list[list[tuple[np.ndarray, np.ndarray]]] = [[] for _ in range(n)]
    if regularisation == "caps":
        for contact in touching:
            back = delta * contact.radius * contact.normal
            flats[contact.sphere].append((contact.point - back, contact.normal))
            if contact.other < n:
                flats[contact.other].append((contact.point + back, -contact.normal))
    for k in range(n):
        ball = Sphere(Pnt(*centres[k]), radii[k]).bc("solid").maxh(mesh_size * radii[k])
        for point, normal in flats[k]:
            ball = ball * _half_space(point, normal).bc("solid")
        body = body - ball
    if regularisation == "bridges":
        for contact in touching:
            body = body - _bridge(contact, centres, n, delta)
    geometry = CSGeometry()
    geometry.Add(body)
    return geometry


def _half_space(point: np.ndarray, normal: np.ndarray) -> Any:
    from netgen.csg import Plane, Pnt, Vec

    return Plane(Pnt(*point), Vec(*normal))


def _box(lower: np.ndarray, upper: np.ndarray) -> Any:
    body = None
    for wall in range(6):
        side = _half_space(upper if WALL_SENSES[wall] > 0.0 else lower, WALL_NORMALS[wall]).bc(f"wall{wall}")
        body = side if body is None else body * side
    return body


def _bridge(contact: Contact, centres: np.ndarray, n: int, delta: float) -> Any:
    from netgen.csg import Cylinder, Pnt

    begin = centres[contact.sphere]
    end = centres[contact.other] if contact.other < n else contact.point + contact.radius * contact.normal
    # Spheres that overlap have a neck already, of radius about √(depth r): the bridge is wider by what δ says.
    radius = float(np.sqrt(max(contact.depth, 0.0) * contact.radius + (delta * contact.radius) ** 2))
    cylinder = Cylinder(Pnt(*begin), Pnt(*end), radius).bc("solid").maxh(2.0 * radius)
    return cylinder * _half_space(begin, -contact.normal) * _half_space(end, contact.normal)
