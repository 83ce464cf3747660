"""Light bounds for light sampling: where lights are, in which directions they emit, and how brightly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ....accel.bvh import Bvh
from ....scene.lights import Bounds, DistantBounds
from .environment_map import LUMINANCE

Doubles = NDArray[np.float64]

#: Margins by which the cones of spots are widened, in radians and in the cosine, since float32 rounds what they are
#: compared with.
WIDER, LESS = 1e-3, 2e-6
#: Margin by which spheres are shrunk, relative to the size of their coordinates: more than what rounding adds to them.
SMALLER = 2.0**-20


@dataclass(frozen=True, eq=False)
class LightGroups:
    """Bounds of n groups of one or more lights each, as used by kernels/light/importance.cl.

    low, high: (n, 3), bounding boxes. radius: (n,), of a bounding sphere around the box's center. axis: (n, 3), unit,
    or 0. cos_cone: (n,), the cosine of the angle around the axis that contains all their normals, −1 if these point in
    all directions. intensity: (n,), total of luminance of radiance times area, or of W/sr. cos_reach: (n,), the cosine
    of the maximum emission angle from the nearest normal, 0 for surfaces.
    """

    low: Doubles
    high: Doubles
    radius: Doubles
    axis: Doubles
    cos_cone: Doubles
    intensity: Doubles
    cos_reach: Doubles

    def __len__(self) -> int:
        return len(self.intensity)


def flat_lights(corners: Doubles, normal: Doubles, intensity: Doubles, both: NDArray[np.bool_]) -> LightGroups:
    """Return the bounds of flat lights with corners (n, k, 3) that emit on the side of their unit normals (n, 3), or on
    both (n,): the latter are bounded as if they emitted in all directions."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    axis, cos_cone = np.where(both[:, None], 0.0, normal), np.where(both, -1.0, 1.0)
    return LightGroups(low, high, _half_diagonal(low, high), axis, cos_cone, intensity, 0 * cos_cone)


def round_lights(center: Doubles, radius: Doubles, intensity: Doubles) -> LightGroups:
    """Return the bounds of spheres, (n, 3) and (n,), that emit in all directions.

    A sphere does not illuminate its own surface. There this depends on the last digit of a difference, which compilers
    round differently, so spheres are considered slightly smaller: where one rises above the horizon by no more than
    that, its light is left to BSDF sampling.
    """
    around = radius[:, None]
    everywhere = -np.ones(len(center))
    smaller = np.maximum(radius - SMALLER * (np.linalg.norm(center, axis=1) + radius), 0)
    return LightGroups(
        center - around, center + around, smaller, np.zeros_like(center), everywhere, intensity, 0 * everywhere
    )


def placed_lights(bounds: Sequence[Bounds]) -> LightGroups:
    """Return the bounds of n lights that have a place but no surface, from float32, as the kernels compute."""
    center = _float32([each.center for each in bounds]).reshape(-1, 3)
    radius, intensity = _float32([each.radius for each in bounds]), _float32([each.intensity for each in bounds])
    axis = _float32([each.axis or (0.0, 0.0, 0.0) for each in bounds]).reshape(-1, 3)
    cos_cone = np.array([-1.0 if each.axis is None else 1.0 for each in bounds])
    cos_outer = 1 - _float32([1.0 if each.height is None else each.height for each in bounds])
    reach = np.cos(np.minimum(np.arccos(np.clip(cos_outer, -1, 1)) + WIDER, np.pi / 2)) - LESS
    around = radius[:, None]
    return LightGroups(
        center - around,
        center + around,
        radius,
        axis,
        cos_cone,
        intensity.reshape(-1, 3) @ LUMINANCE,
        np.maximum(reach, 0),
    )


def distant_lights(bounds: Sequence[DistantBounds]) -> Doubles:
    """Return (n, 4) for `pack_choice`: a scalar and a vector for each of n lights, whose irradiance at a normal is
    about scalar + vector·normal."""
    towards = _float32([each.towards for each in bounds]).reshape(-1, 3)
    luminance = _float32([each.radiance for each in bounds]).reshape(-1, 3) @ LUMINANCE
    irradiance = np.array([each.projected for each in bounds]) * luminance
    return np.asarray(np.column_stack([[each.least for each in bounds], towards]) * irradiance[:, None])


def _float32(values: Sequence[object]) -> Doubles:
    return np.array(values, np.float32).astype(np.float64)


def joined(parts: Sequence[LightGroups]) -> LightGroups:
    """Return all groups of the parts."""
    return LightGroups(*(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(LightGroups)))


def groups_of_nodes(tree: Bvh, lights: LightGroups) -> LightGroups:
    """Return the light bounds of the nodes of a binary BVH over `lights`, with one light per leaf.

    The axis is the mean of the normals, weighted by intensity; the cone around it is as narrow as possible.
    """
    levels, leaf = list(tree.levels()), tree.leaf
    own = tree.order[tree.left_first[leaf]]
    first, count = np.where(leaf, tree.left_first, 0), leaf.astype(np.int64)
    intensity, axis = np.zeros(len(leaf)), np.zeros((len(leaf), 3))
    intensity[leaf], axis[leaf] = lights.intensity[own], (lights.axis * lights.intensity[:, None])[own]
    for level in reversed(levels):
        inner = level[~leaf[level]]
        left = tree.left_first[inner]
        first[inner] = first[left]
        for values in (count, intensity, axis):
            values[inner] = values[left] + values[left + 1]
    norm = np.linalg.norm(axis, axis=1)
    axis /= np.where(norm > 0, norm, 1)[:, None]
    low, high = tree.aabb_min.astype(np.float64), tree.aabb_max.astype(np.float64)
    radius, cos_cone, cos_reach = _half_diagonal(low, high), np.empty(len(leaf)), np.empty(len(leaf))
    radius[leaf] = lights.radius[own]
    for level in levels:
        start = np.cumsum(count[level]) - count[level]
        inside = tree.order[np.arange(count[level].sum()) + np.repeat(first[level] - start, count[level])]
        cosine = np.einsum("ij,ij->i", lights.axis[inside], np.repeat(axis[level], count[level], axis=0))
        cos_cone[level] = np.minimum.reduceat(np.where(lights.cos_cone[inside] < 0, -1.0, cosine), start)
        cos_reach[level] = np.minimum.reduceat(lights.cos_reach[inside], start)
    return LightGroups(low, high, radius, axis, np.clip(cos_cone, -1, 1), intensity, cos_reach)


def _half_diagonal(low: Doubles, high: Doubles) -> Doubles:
    return np.asarray(np.linalg.norm(high - low, axis=1) / 2)
