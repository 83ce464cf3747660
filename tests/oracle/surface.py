"""Ray hits: positions, normals, and material parameters."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from clrt.scene.materials.material import Material
from clrt.scene.materials.textures import Texture

from .geometry import Geometry, Hits
from .textures import color_at, number_at
from .vectors import Bools, Doubles, Whole, dot, unit


@dataclass
class Surface:
    """Points on primitives, by row.

    normal, shading_normal: unit, on the side that the ray came from; front: whether that is the front; uv: (n, 2, 2) of
    both sets of texture coordinates; tint: (n, 4) vertex colors.
    """

    p: Doubles
    normal: Doubles
    shading_normal: Doubles
    front: Bools
    uv: Doubles
    tint: Doubles

    def rows(self, chosen: Bools | Whole) -> Surface:
        """Return a subset of the rows."""
        return Surface(*(getattr(self, each.name)[chosen] for each in fields(self)))

    def put(self, rows: Whole, other: Surface) -> None:
        """Replace these rows by another surface."""
        for each in fields(self):
            getattr(self, each.name)[rows] = getattr(other, each.name)

    def number(self, value: float | Texture) -> Doubles:
        """Return the value (n,) of a scalar parameter."""
        if isinstance(value, Texture):
            return number_at(value, self.uv[:, value.uv_set])
        return np.full(len(self.p), float(value))

    def color(self, value: tuple[float, ...] | Texture) -> Doubles:
        """Return the value (n, 3) of a colour parameter."""
        if isinstance(value, Texture):
            return color_at(value, self.uv[:, value.uv_set])
        return np.tile(np.array(value, float), (len(self.p), 1))

    def tinted(self, value: tuple[float, ...] | Texture) -> Doubles:
        """Return the value (n, 3) of the parameter `color`, times vertex colours."""
        return self.color(value) * self.tint[:, :3]

    def opacity(self, material: Material) -> Doubles:
        """Return the share of light that a material stops, (n,)."""
        opacity = self.number(material.opacity) * self.tint[:, 3]
        if material.alpha_cutoff is not None:
            opacity = (opacity >= material.alpha_cutoff).astype(float)
        return np.where(self.front | (not material.one_sided), opacity, 0.0)

    def emitted(self, material: Material) -> Doubles:
        """Return the radiance (n, 3) towards the ray's origin, from the front only."""
        return self.color(material.emission) * self.front[:, None]


def surface_at(geometry: Geometry, hits: Hits, origin: Doubles, direction: Doubles) -> Surface:
    """Return the surface at each hit; rows of misses are arbitrary."""
    n, triangles = len(origin), len(geometry.corners)
    p = origin + np.where(hits.missed, 0, hits.t)[:, None] * direction
    normal, uv, tint = np.tile([0.0, 0.0, 1.0], (n, 1)), np.zeros((n, 2, 2)), np.ones((n, 4))
    shading_normal = normal.copy()
    of_mesh, of_sphere = hits.primitive < triangles, (hits.primitive >= triangles) & ~hits.missed
    which, weights = hits.primitive[of_mesh], hits.weights[of_mesh]

    def interpolated(values: Doubles) -> Doubles:
        return np.asarray(np.einsum("nk,nkc->nc", weights, values[which]))

    normal[of_mesh] = geometry.normal[which]
    smooth = interpolated(geometry.shading_normals)
    shading_normal[of_mesh] = unit(np.where(hits.missed[of_mesh, None], 1, smooth))
    for number, coordinates in enumerate((geometry.uv, geometry.uv1)):
        uv[of_mesh, number] = interpolated(coordinates)
    tint[of_mesh] = interpolated(geometry.colors)
    outward = unit(p[of_sphere] - geometry.center[hits.primitive[of_sphere] - triangles])
    normal[of_sphere] = shading_normal[of_sphere] = outward
    # An image covers a sphere once, its middle towards +Z, its top towards +Y, upright seen from outside.
    around = 0.5 + np.arctan2(outward[:, 0], outward[:, 2]) / (2 * np.pi)
    uv[of_sphere] = np.column_stack([around, np.arccos(np.clip(outward[:, 1], -1, 1)) / np.pi])[:, None]
    front = dot(normal, direction) < 0
    side = np.where(front, 1, -1)[:, None]
    # A shading normal that faces away from the ray is replaced by the geometric one.
    towards = dot(shading_normal, direction) * side[:, 0] < 0
    return Surface(p, side * normal, side * np.where(towards[:, None], shading_normal, normal), front, uv, tint)
