"""Contacts that yield within a step: what their forces change by as grains move, for steps beyond the critical one.

In a step as long as several, contacts cannot keep the forces that they have at its beginning. A contact of stiffness k
that yields takes -k t u besides, with u the relative velocity over the step and t the part of the step in which it
acts. That is linear in the velocities, and has the kinematics of the resistance of pairs
(`porefv.coupling.pair_resistance`): both are implicit in one equation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from porefv.packing.box import WALL_AXES, WALL_SENSES
from porefv.system.kernels import kernel

# Part of Coulomb's limit from which on a contact slides.
_SLIDES = 1.0 - 1e-9


class YieldingContacts(NamedTuple):
    """Pairs of grains, or of a grain and a wall, that touch within a step.

    Rows are those of `GrainModel.predict`: grains, then the six walls.

    Attributes
    ----------
    members : (p, 2) uint32 array
    normals : (p, 3) array
        From the first to the second [-].
    arms : (p, 2) array
        From the centres to the middle of the overlap; zero for a wall, which does not turn [m].
    normal, tangential : (p,) arrays
        What a relative velocity along the normal, and across it, takes from the force over the step [N s/m].
    rolling : (p,) array
        Zero: contacts do not resist it.
    """

    members: np.ndarray
    normals: np.ndarray
    arms: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray
    rolling: np.ndarray

    @classmethod
    def room(cls, count: int) -> YieldingContacts:
        """Room for so many."""
        normal, tangential, rolling = np.zeros((3, count))
        members, normals, arms = np.empty((count, 2), np.uint32), np.empty((count, 3)), np.empty((count, 2))
        return cls(members, normals, arms, normal, tangential, rolling)

    def first(self, count: int) -> YieldingContacts:
        """The first so many."""
        return YieldingContacts(*(array[:count] for array in self))


@kernel(error_model="numpy")
def find_yielding(parameters, grains, pairs, wall_pairs, walls, loads, contacts):
    """Fill in the contacts that yield within a step, and take from sliding ones what the step spares them.

    A contact acts from where it closes to where it opens, at the velocities of the step before. One that slides keeps
    to Coulomb's limit at these velocities: by a part of its force, and the same part of its stiffness.

    Parameters
    ----------
    parameters : StepParameters
        `dt` is the length of the step that begins.
    grains : Grains
    pairs : GrainPairs
        Their forces are those at the beginning of the step.
    wall_pairs : WallPairs
    walls : MovingWalls
        What is taken from sliding contacts changes their forces.
    loads : (n, 6) array
        Of contacts on grains, likewise [N, N m].
    contacts : YieldingContacts
        With room for all pairs.

    Returns
    -------
    int
        How many there are.
    """
    motion, n = grains.motion, grains.motion.shape[0]
    dt, ratio = parameters.dt, parameters.ratio
    wall_count = wall_pairs.members.shape[0]
    spared = np.empty(3)
    found = 0
    for k in range(pairs.others.shape[0] + wall_count):
        c = k - wall_count
        normal = contacts.normals[found]
        if c < 0:
            i, wall = wall_pairs.members[k, 0], wall_pairs.members[k, 1]
            j = n + wall
            axis = WALL_AXES[wall]
            distance = WALL_SENSES[wall] * (walls.places[wall] - motion[i, axis])
            overlap = motion[i, 3] - distance
            normal[:] = 0.0
            normal[axis] = WALL_SENSES[wall]
            p, q = distance, 0.0
            stiffness, friction, shear = wall_pairs.stiffness[k], walls.friction[wall], wall_pairs.shear[k]
            vx, vy, vz = walls.velocities[wall, 0], walls.velocities[wall, 1], walls.velocities[wall, 2]
            wx = wy = wz = 0.0
        else:
            i, j = pairs.grains[c, 0], pairs.grains[c, 1]
            dx, dy, dz = motion[j, 0] - motion[i, 0], motion[j, 1] - motion[i, 1], motion[j, 2] - motion[i, 2]
            distance = np.sqrt(dx * dx + dy * dy + dz * dz)
            overlap = motion[i, 3] + motion[j, 3] - distance
            normal[0], normal[1], normal[2] = dx / distance, dy / distance, dz / distance
            p = motion[i, 3] - 0.5 * overlap
            q = distance - p
            stiffness, friction, shear = pairs.stiffness[c], parameters.friction, pairs.shear[c]
            vx, vy, vz = motion[j, 4], motion[j, 5], motion[j, 6]
            wx, wy, wz = motion[j, 7], motion[j, 8], motion[j, 9]
        sx, sy, sz = p * motion[i, 7] + q * wx, p * motion[i, 8] + q * wy, p * motion[i, 9] + q * wz
        ux = vx - motion[i, 4] - (sy * normal[2] - sz * normal[1])
        uy = vy - motion[i, 5] - (sz * normal[0] - sx * normal[2])
        uz = vz - motion[i, 6] - (sx * normal[1] - sy * normal[0])
        opening = ux * normal[0] + uy * normal[1] + uz * normal[2]
        acts = dt
        if overlap <= 0.0:  # it closes within the step, if at all
            acts = dt + overlap / -opening if opening * dt < overlap else 0.0
        elif opening * dt > overlap:
            acts = overlap / opening
        if acts <= 0.0:
            continue
        contacts.members[found, 0], contacts.members[found, 1] = i, j
        contacts.arms[found, 0], contacts.arms[found, 1] = p, q
        contacts.normal[found] = stiffness * acts
        contacts.tangential[found] = 0.0
        if overlap > 0.0 and ratio > 0.0 and friction > 0.0:
            size = np.sqrt(shear[0] ** 2 + shear[1] ** 2 + shear[2] ** 2)
            most = friction * stiffness * overlap
            kept = 1.0
            if size >= _SLIDES * most and size > 0.0:
                growth = ratio * stiffness * acts * (ux * shear[0] + uy * shear[1] + uz * shear[2]) / size
                kept = most / (most + max(growth, 0.0))
                spared[:] = (kept - 1.0) * shear
                tx = normal[1] * spared[2] - normal[2] * spared[1]
                ty = normal[2] * spared[0] - normal[0] * spared[2]
                tz = normal[0] * spared[1] - normal[1] * spared[0]
                loads[i, 0] += spared[0]
                loads[i, 1] += spared[1]
                loads[i, 2] += spared[2]
                loads[i, 3] += p * tx
                loads[i, 4] += p * ty
                loads[i, 5] += p * tz
                if c < 0:
                    for a in range(3):
                        walls.forces[wall, a] -= spared[a]
                else:
                    loads[j, 0] -= spared[0]
                    loads[j, 1] -= spared[1]
                    loads[j, 2] -= spared[2]
                    loads[j, 3] += q * tx
                    loads[j, 4] += q * ty
                    loads[j, 5] += q * tz
            contacts.tangential[found] = kept * ratio * stiffness * acts
        found += 1
    return found
