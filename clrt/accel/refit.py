"""Refit a BVH to moved vertices: boxes are recomputed bottom-up, and its topology stays (kernels/build/refit.cl)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..device.launches.data_parallel import DataParallel
from ..device.launches.device_arrays import empty_array, on_device, on_host
from ..device.open import Device
from ..device.programs.preamble import defines, typedefs
from ..device.programs.program import compose
from .bvh import FloatArray, IntArray
from .layouts import BVH2_NODE, BVH8_NODE, LEAF_TRIANGLE, TRIANGLE_PACK, Layout
from .wide import EMPTY


class RefitLayout(NamedTuple):
    """How a layout is refitted. file: the kernel for a level; node, leaf: its records; leaves: the buffer of leaves.

    gap: unused nodes between the root and the level below it.
    """

    file: str
    node: np.dtype[np.void]
    leaf: np.dtype[np.void]
    leaves: str
    gap: int


RECIPES = {
    "bvh8": RefitLayout("build/refit_bvh8.cl", BVH8_NODE, TRIANGLE_PACK, "packs", 0),
    "bvh2": RefitLayout("build/refit_bvh2.cl", BVH2_NODE, LEAF_TRIANGLE, "leaf_triangles", 1),
}


def can_refit(tree: Layout) -> bool:
    """Return whether the BVH can be refitted: a layout in RECIPES, in level order, leaves with corners, no spheres."""
    if tree.name not in RECIPES or not tree.level_sizes or "leaf_spheres" in tree.buffers:
        return False
    recipe = RECIPES[tree.name]
    return recipe.leaves in tree.buffers and bool(tree.buffers[recipe.leaves].dtype == recipe.leaf)


class Refitter:
    """Refitter of one BVH, whose buffers are on the device, over faces (m, 3) int32 and n vertices."""

    def __init__(self, device: Device, tree: Layout, faces: IntArray, vertices: int) -> None:
        self._device, self._recipe = device, RECIPES[tree.name]
        self._work = DataParallel(device, program_source(tree.name))
        self._levels = tree.level_sizes
        self._faces, self._vertices = on_device(device, faces), empty_array(device, np.float32, 3 * vertices)
        self._tree = [tree.buffers[name].buffer for name in ("nodes", self._recipe.leaves)]

    def refit(self, vertices: FloatArray) -> None:
        """Write new boxes and corners into the BVH's buffers. vertices: (n, 3), finite, in the BVH's unit."""
        self._vertices.write(self._device, vertices.reshape(-1))
        end = sum(self._levels)
        for level in reversed(range(len(self._levels))):
            first = end - self._levels[level]
            self._work.run_each(
                "refit_level",
                self._levels[level],
                first + self._recipe.gap * (level > 0),
                self._vertices.buffer,
                self._faces,
                *self._tree,
            )
            end = first


def relative_area(device: Device, tree: Layout) -> float:
    """Return the sum of the areas of all boxes of a BVH that can be refitted, relative to the root's: about the number
    of boxes that a ray hits. It grows as a refit moves neighbors apart."""
    nodes = on_host(device, tree.buffers["nodes"])
    low, high = ("lo", "hi") if tree.name == "bvh8" else ("aabb_min", "aabb_max")
    boxes = [nodes[name].reshape(len(nodes), 3, -1).astype(np.float64) for name in (low, high)]
    first = [boxes[0][0].min(axis=1), boxes[1][0].max(axis=1)]
    root = _area(*(end[None, :, None] for end in first))
    return _area(*boxes) / root if root > 0 else 1.0


def _area(low: NDArray[np.float64], high: NDArray[np.float64]) -> float:
    """Return half the summed area of boxes (n, 3, k); inverted ones, of unused slots, have none."""
    x, y, z = np.maximum(high - low, 0).transpose(1, 0, 2)
    return float(np.sum(x * y + y * z + z * x))


def program_source(layout: str) -> str:
    """Return the program that refits BVHs of a layout."""
    recipe = RECIPES[layout]
    preamble = [
        defines({"EMPTY": EMPTY, "TRIANGLES": 1, "SPHERES": 0}),
        typedefs({"Node": recipe.node, "Triangles": recipe.leaf}),
    ]
    return compose("\n".join(preamble), recipe.file, {})
