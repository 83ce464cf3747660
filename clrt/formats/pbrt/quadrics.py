"""pbrt's spheres, disks and cylinders, also parts of these, as meshes with its texture coordinates and normals."""

from __future__ import annotations

from math import acos, pi, radians

import numpy as np

from ...scene.model import Mesh
from ..scene_parts.grids import grid, mesh_of, quads
from .entities import Entity

#: Segments around a full turn, and from pole to pole or from a disk's center to its rim.
TURN, ACROSS = 256, 128


def is_whole_sphere(entity: Entity) -> bool:
    """Return whether a sphere has all its surface."""
    radius = entity.number("radius", 1.0)
    low, high = entity.number("zmin", -radius), entity.number("zmax", radius)
    return max(low, high) >= radius and min(low, high) <= -radius and entity.number("phimax", 360.0) >= 360


def sphere(entity: Entity) -> Mesh:
    """Return a sphere about z; u goes around from +x, v from zmin to zmax."""
    radius = entity.number("radius", 1.0)
    ends = [entity.number("zmin", -radius), entity.number("zmax", radius)]
    low, high = (acos(min(max(z / radius, -1), 1)) if radius else pi for z in (min(ends), max(ends)))
    u, v = grid(TURN, ACROSS)
    phi, theta = _turn(entity) * u, low + v * (high - low)
    outward = np.column_stack([np.cos(phi) * np.sin(theta), np.sin(phi) * np.sin(theta), np.cos(theta)])
    return mesh_of("sphere", radius * outward, quads(TURN, ACROSS), np.column_stack([u, v]), outward)


def disk(entity: Entity) -> Mesh:
    """Return a disk across z, facing +z; u goes around from +x, v from the rim to the center."""
    radius, hole = entity.number("radius", 1.0), entity.number("innerradius", 0.0)
    u, v = grid(TURN, ACROSS)
    phi, out = _turn(entity) * u, radius + v * (hole - radius)
    points = np.column_stack([out * np.cos(phi), out * np.sin(phi), np.full(len(u), entity.number("height", 0.0))])
    normals = np.tile((0.0, 0.0, 1.0), (len(u), 1))
    return mesh_of("disk", points, quads(TURN, ACROSS), np.column_stack([u, v]), normals)


def cylinder(entity: Entity) -> Mesh:
    """Return a cylinder about z, open at both ends; u goes around from +x, v from zmin to zmax."""
    ends = [entity.number("zmin", -1.0), entity.number("zmax", 1.0)]
    u, v = grid(TURN, 1)
    phi, radius = _turn(entity) * u, entity.number("radius", 1.0)
    around = np.column_stack([np.cos(phi), np.sin(phi)])
    points = np.column_stack([radius * around, min(ends) + v * (max(ends) - min(ends))])
    return mesh_of(
        "cylinder", points, quads(TURN, 1), np.column_stack([u, v]), np.column_stack([around, np.zeros(len(u))])
    )


def _turn(entity: Entity) -> float:
    return radians(min(max(entity.number("phimax", 360.0), 0.0), 360.0))
