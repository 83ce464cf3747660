"""All primitives of a scene in world space, and brute-force intersection of rays with them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clrt.scene.materials.material import Material
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Scene

from .corners import Corners
from .vectors import Bools, Doubles, Whole, dot, unit

#: Closer hits are the surface that a ray leaves: scenes are about 1 in size, and rounding errors about 1e-15.
NEAREST = 1e-6
#: Number of rays whose tests of all primitives fit in a processor's cache.
AT_A_TIME = 128


@dataclass
class Hits:
    """Hits per ray: t along its unit direction, infinite for a miss; the primitive, triangles first; barycentrics
    of a triangle's corners, (n, 3)."""

    t: Doubles
    primitive: Whole
    weights: Doubles

    @property
    def missed(self) -> Bools:
        return np.isinf(self.t)


class Geometry:
    """Triangles of all meshes and instances, at least one, followed by spheres.

    materials: those of the whole scene; material: (n,) material index per primitive. Per triangle corner: uv, uv1
    (t, 3, 2), colors (t, 3, 4), shading_normals (t, 3, 3).
    """

    def __init__(self, scene: Scene) -> None:
        placed = [(mesh, np.eye(3, 4), mesh.material) for mesh in scene.meshes]
        placed += [(each.mesh, each.to_world, each.material or each.mesh.material) for each in scene.instances]
        self.materials: list[Material] = []
        at = Corners.joined([Corners.placed(mesh, matrix) for mesh, matrix, _ in placed])
        self.corners, self.uv, self.uv1, self.colors, self.shading_normals = at.p, at.uv, at.uv1, at.colors, at.normals
        numbers = [np.full(len(mesh.faces), self._number(material)) for mesh, _, material in placed]
        numbers += [np.array([self._number(each.material or Diffuse()) for each in scene.spheres], int)]
        self.material: Whole = np.concatenate(numbers)
        self.center = np.array([each.center for each in scene.spheres], float).reshape(-1, 3)
        self.radius = np.array([each.radius for each in scene.spheres], float)
        p0, p1, p2 = self.corners.swapaxes(0, 1)
        cross = np.cross(p1 - p0, p2 - p0)
        self.normal = unit(cross)
        flat = ~self.shading_normals.any(axis=(1, 2))
        self.shading_normals[flat] = self.normal[flat, None]
        # Plücker coordinates p×q and q − p of each edge p→q, opposite corner 0, 1 and 2.
        edges = [np.hstack([np.cross(p, q), q - p]) for p, q in ((p1, p2), (p2, p0), (p0, p1))]
        self._edges = [np.ascontiguousarray(each.T) for each in edges]
        self._planes, self._offsets = np.ascontiguousarray(cross.T), dot(cross, p0)

    def _number(self, material: Material) -> int:
        for number, known in enumerate(self.materials):
            if known is material:
                return number
        self.materials.append(material)
        return len(self.materials) - 1

    def nearest(self, origin: Doubles, direction: Doubles) -> Hits:
        """Return the closest hits along unit directions beyond NEAREST."""
        hits = Hits(np.full(len(origin), np.inf), np.zeros(len(origin), int), np.zeros((len(origin), 3)))
        for first in range(0, len(origin), AT_A_TIME):
            rows = slice(first, first + AT_A_TIME)
            found = self._nearest(origin[rows], direction[rows])
            hits.t[rows], hits.primitive[rows], hits.weights[rows] = found.t, found.primitive, found.weights
        return hits

    def _nearest(self, origin: Doubles, direction: Doubles) -> Hits:
        n, triangles = len(origin), len(self.corners)
        found, weights = np.full((n, triangles + len(self.radius)), np.inf), np.zeros((n, 3))
        line = np.hstack([direction, np.cross(origin, direction)])
        sides = [line @ edge for edge in self._edges]
        found[:, :triangles] = self._triangles(sides, origin)
        found[:, triangles:] = self._spheres(origin, direction)
        primitive = found.argmin(axis=1)
        t = found[np.arange(n), primitive]
        met = np.flatnonzero((primitive < triangles) & np.isfinite(t))
        chosen = np.column_stack([side[met, primitive[met]] for side in sides])
        weights[met] = chosen / chosen.sum(axis=1, keepdims=True)
        return Hits(t, primitive, weights)

    def _triangles(self, sides: list[Doubles], origin: Doubles) -> Doubles:
        """Return t of each triangle: a ray that hits passes on the same side of all three edges (Shoemake 1998,
        "Plücker coordinate tutorial"); their sum is its direction's component along the normal."""
        a, b, c = sides
        least, most = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (self._offsets - origin @ self._planes) / (a + b + c)
        return np.where(((least >= 0) | (most <= 0)) & (t > NEAREST), t, np.inf)

    def _spheres(self, origin: Doubles, direction: Doubles) -> Doubles:
        away = origin[:, None] - self.center
        b = np.einsum("nki,ni->nk", away, direction)
        inside = self.radius**2 - dot(away, away) + b * b
        half = np.sqrt(np.maximum(inside, 0))
        t = np.where(-b - half > NEAREST, -b - half, -b + half)
        return np.where((inside > 0) & (t > NEAREST), t, np.inf)
