"""Bump maps as normal maps of a mesh.

A bump map lifts a surface by a height along its normal n, which makes the normal n − ∇h. The slopes of ∇h, along the
image's right and up on the surface, follow from the height's gradient in the image and from the size of the image on
the surface, which a mesh's texture coordinates determine: the same everywhere on a rectangle, a median on others.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scene.materials.textures import Picture, Texture, Wrap
from ...scene.model import Mesh
from .values import Doubles
from .xml import Plugin

#: A normal map has FINEST times as many texels as the heights in each direction, fewer if a side had more than LONGEST
#: texels, but twice as many at least: slopes are constant across a texel, which interpolated normals only approximate.
FINEST, LONGEST = 8, 2048
#: Relative deviation up to which the image has the same size everywhere, and the share of the area that may have none.
EVEN, DEGENERATE = 1e-3, 1e-6
#: Maximum number of triangles whose sizes are kept apart, and of texels of a triangle.
MOST_TRIANGLES, MOST_TEXELS = 200_000, 1 << 24
#: The share of the texels that triangles with UNLIKE sizes may have in common, and how far they are beyond an edge.
SHARED, UNLIKE, ON_EDGE = 0.02, 0.1, 1e-9
TINY = 1e-300
#: Twice the smallest area of a triangle in the image, of which it has none otherwise.
THINNEST = 1e-18


@dataclass(frozen=True, eq=False)
class Bump:
    """Heights in scene units: a texture of numbers times `scale`. plugin: the bump map."""

    plugin: Plugin
    heights: Texture
    scale: float


class ImageSize(NamedTuple):
    """The image on a surface, in scene units: length of its lower edge, its height, and how far the point above the
    lower left corner is to the right of it; numbers, or arrays by triangle or texel."""

    width: Doubles
    height: Doubles
    lean: Doubles


class Sizes(NamedTuple):
    """The size of the image over a mesh: `median`, and if it is `even`, everywhere; else by the texels (h, w) of the
    normal map, or None if several triangles of different sizes have a texel."""

    median: ImageSize
    even: bool
    texels: ImageSize | None


def sizes_over(mesh: Mesh, heights: Texture) -> Sizes:
    """Return the size of the image over a mesh with texture coordinates."""
    assert mesh.uv is not None
    corners = mesh.vertices.astype(np.float64)[mesh.faces]
    at = mesh.uv.astype(np.float64)[mesh.faces] @ heights.to_picture[:, :2].T + heights.to_picture[:, 2]
    edges, steps = (np.stack([each[:, 1] - each[:, 0], each[:, 2] - each[:, 0]], axis=2) for each in (corners, at))
    area = np.linalg.norm(np.cross(edges[..., 0], edges[..., 1]), axis=1)
    used = (np.abs(np.linalg.det(steps)) > THINNEST) & (area > 0)
    if not used.any():
        return Sizes(ImageSize(*np.array([1.0, 1.0, 0.0])), False, None)
    right, down = np.moveaxis(edges[used] @ _inverses(steps[used]), 2, 0)
    width = np.linalg.norm(right, axis=1)
    lean = -np.sum(right * down, axis=1) / width
    found = ImageSize(width, np.sqrt(np.maximum(np.sum(down**2, axis=1) - lean**2, 0)), lean)
    median = ImageSize(*(_median(values, area[used]) for values in found))
    off = [np.abs(values - middle) > EVEN * median.width for values, middle in zip(found, median)]
    uneven = float(area[used][np.any(off, axis=0)].sum() + area[~used].sum())
    even = uneven <= DEGENERATE * float(area.sum())
    return Sizes(median, even, None if even else _by_texel(found, median, at[used], heights))


def _inverses(matrices: Doubles) -> Doubles:
    """Return the inverses of matrices (n, 2, 2), which numpy refuses if one is singular to rounding."""
    (a, b), (c, d) = np.moveaxis(matrices, 0, 2)
    return np.moveaxis(np.array([[d, -b], [-c, a]]) / np.linalg.det(matrices), 2, 0)


def _median(values: Doubles, weights: Doubles) -> Doubles:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return np.asarray(values[order][np.searchsorted(total, total[-1] / 2)])


def _by_texel(found: ImageSize, median: ImageSize, at: Doubles, heights: Texture) -> ImageSize | None:
    """Return the sizes of triangles, whose corners (n, 3, 2) are `at` places of the image, by the texels of the normal
    map; outside of triangles the median."""
    rows, columns = np.array(heights.picture.texels.shape[:2]) * finer(heights)
    if len(at) > MOST_TRIANGLES:
        return None
    places = at * (columns, rows) - 0.5
    inverses = _inverses(np.stack([at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]], axis=2)) / (columns, rows)
    low, high = np.ceil(places.min(axis=1)).astype(int), np.floor(places.max(axis=1)).astype(int) + 1
    if np.prod(np.maximum(high - low, 0), axis=1).max() > MOST_TEXELS:
        return None
    owner, shared = np.full((rows, columns), -1, np.int32), 0
    for number, ((left, top), (right, bottom)) in enumerate(zip(low.tolist(), high.tolist())):
        if left >= right or top >= bottom:
            continue
        x, y = np.arange(left, right)[None, :], np.arange(top, bottom)[:, None]
        (a, b), (c, d) = inverses[number]
        dx, dy = x - places[number, 0, 0], y - places[number, 0, 1]
        u, v = a * dx + b * dy, c * dx + d * dy
        inside = (u >= -ON_EDGE) & (v >= -ON_EDGE) & (u + v <= 1 + ON_EDGE)
        row, column = np.nonzero(inside)
        row, column = (row + top) % rows, (column + left) % columns
        before = owner[row, column]
        differs = np.abs(found.width[before] - found.width[number]) > UNLIKE * median.width
        shared += int(np.count_nonzero((before >= 0) & differs))
        owner[row, column] = number
    if shared > SHARED * np.count_nonzero(owner >= 0):
        return None
    parts = (np.where(owner >= 0, values.astype(np.float32)[owner], middle) for values, middle in zip(found, median))
    return ImageSize(*parts)


def normal_map(bump: Bump, size: ImageSize) -> Texture:
    """Return the normal map of heights on a surface where the image has this size, to half a step of 8 bits."""
    heights = bump.heights.picture.texels[..., 0] / 255 * np.max(bump.heights.factor) * bump.scale
    right, down = gradient(heights, bump.heights.wrap, finer(bump.heights))
    # The gradient along the image's right, and along its up: what is left of −down beyond the lean.
    along = right / np.maximum(size.width, TINY)
    up = (-down - size.lean * along) / np.maximum(size.height, TINY)
    steepest = np.maximum(np.abs(along), np.abs(up))
    factor = float(np.clip(steepest.max(), 1e-12, 1))  # of x and y, which spreads small slopes over all levels
    length = np.maximum(steepest / factor, 1)
    texels = np.full((*along.shape, 4), 255, np.uint8)
    for channel, part in enumerate((-along / factor, -up / factor, np.ones_like(up))):
        texels[..., channel] = np.round((1 + part / length) / 2 * 255)
    name = f"{bump.heights.picture.name} as normals"
    return replace(bump.heights, picture=Picture(texels, name), factor=factor, channel="red", filter="linear")


def finer(heights: Texture) -> int:
    """Return how many texels a normal map has per texel of the heights, in each direction."""
    longest = int(max(heights.picture.texels.shape[:2]))
    return min(max(LONGEST // longest, 2), FINEST)


def gradient(heights: Doubles, wrap: tuple[Wrap, Wrap], times: int) -> tuple[Doubles, Doubles]:
    """Return the derivatives of heights (h, w) to the right and down, per image, of their bilinear interpolation at the
    texels of an image `times` as fine."""
    rows, columns = heights.shape
    (left, right, x), (above, below, y) = _cells(columns, wrap[0], times), _cells(rows, wrap[1], times)
    across = columns * (heights[:, right] - heights[:, left])
    down = rows * (heights[below] - heights[above])
    y = y[:, None]
    return across[above] * (1 - y) + across[below] * y, down[:, left] * (1 - x) + down[:, right] * x


def _cells(count: int, wrap: Wrap, times: int) -> tuple[NDArray[np.int64], NDArray[np.int64], Doubles]:
    """Return for each finer texel the two texels around it, and its place between them from 0 to 1."""
    at = (np.arange(times * count) + 0.5) / times - 0.5
    low = np.floor(at).astype(np.int64)
    first, second = low, low + 1
    if wrap == "repeat":
        return first % count, second % count, at - low
    return first.clip(0, count - 1), second.clip(0, count - 1), at - low
