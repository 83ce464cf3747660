"""What is known of lights when one of them is to be chosen: where they are, where they shine, and how brightly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..accel.tree import Tree

Doubles = NDArray[np.float64]

#: By how much the cones of spots are widened, in radians and in the cosine, since float32 rounds what they are compared
#: with.
WIDER, LESS = 1e-3, 2e-6
#: By how much balls are made smaller, over the size of their coordinates: by more than what rounding adds to them.
SMALLER = 2.0**-20


@dataclass(frozen=True, eq=False)
class LightGroups:
    """n groups of one or more lights each, as kernels/light/importance.cl sees them.

    low, high: (n, 3), the boxes around them. radius: (n,), of a sphere around the box's middle that holds them. axis:
    (n, 3), unit, or 0. cos_cone: (n,), the cosine of the angle from the axis within which all their normals lie, −1
    where these point everywhere. intensity: (n,), luminance of radiance times area, or of W/sr, all together.
    cos_reach: (n,), the cosine of the angle from the nearest normal up to which they shine, 0 for surfaces.
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
    """Flat lights with corners (n, k, 3) that shine on the side of their unit normals (n, 3), or on both (n,): these
    are bounded as if they shone everywhere."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    axis, cos_cone = np.where(both[:, None], 0.0, normal), np.where(both, -1.0, 1.0)
    return LightGroups(low, high, _half_diagonal(low, high), axis, cos_cone, intensity, 0 * cos_cone)


def round_lights(center: Doubles, radius: Doubles, intensity: Doubles) -> LightGroups:
    """Balls, (n, 3) and (n,), that shine everywhere, or points.

    A ball brings nothing to its own surface. There that hangs on the last digit of a difference, which compilers round
    in their own ways, so balls are taken for a little smaller: where one rises above the horizon by no more than that,
    its light is left to paths that meet it by chance.
    """
    around = radius[:, None]
    everywhere = -np.ones(len(center))
    smaller = np.maximum(radius - SMALLER * (np.linalg.norm(center, axis=1) + radius), 0)
    return LightGroups(center - around, center + around, smaller, np.zeros_like(center), everywhere, intensity,
                       0 * everywhere)


def spot_lights(place: Doubles, axis: Doubles, cos_outer: Doubles, intensity: Doubles) -> LightGroups:
    """Points (n, 3) that shine in cones around unit axes (n, 3), whose angles have the cosines (n,)."""
    ones = np.ones(len(place))
    reach = np.cos(np.minimum(np.arccos(np.clip(cos_outer, -1, 1)) + WIDER, np.pi / 2)) - LESS
    return LightGroups(place, place, 0 * ones, axis, ones, intensity, np.maximum(reach, 0))


def joined(parts: Sequence[LightGroups]) -> LightGroups:
    """All groups of the parts."""
    return LightGroups(*(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(LightGroups)))


def groups_of_nodes(tree: Tree, lights: LightGroups) -> LightGroups:
    """The groups that the nodes of a tree over `lights`, one a leaf, stand for.

    The axis is the mean of the normals, weighted by intensity; the cone around it is as narrow as can be.
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
