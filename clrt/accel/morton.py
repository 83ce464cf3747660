"""Sort primitives along a space-filling curve on the device (kernels/build/morton.cl, sort.cl)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyopencl as cl

from ..device.launches.data_parallel import DataParallel
from .bvh import FloatArray, Triangles

CODE_BITS, DIGIT_BITS = 63, 8
#: Number of cells along the longest extent of the centres, minus one.
CELLS = (1 << CODE_BITS // 3) - 1
#: Floats per primitive.
SHAPE = 9


@dataclass(frozen=True, eq=False)
class Primitives:
    """Triangles and spheres on the device in Morton order.

    shapes: (count, 9) float32, corners, or center and radius. ids: (count,) uint32, their numbers in the scene, where
    triangles come first.
    """

    shapes: cl.Buffer
    ids: cl.Buffer
    triangle_count: int
    count: int

    @property
    def arguments(self) -> Sequence[cl.Buffer | int]:
        """Return the kernel arguments for PRIMITIVE_PARAMETERS."""
        return self.shapes, self.ids, self.triangle_count


Scene = tuple[cl.Buffer, cl.Buffer, int]  # triangles, spheres, and how many triangles there are


def sort_primitives(work: DataParallel, triangles: Triangles, spheres: FloatArray) -> Primitives:
    """Sort triangles and spheres (s, 4), float32, along a Morton curve through the centres of their boxes."""
    count = len(triangles) + len(spheres)
    scene = work.lend(np.asarray(triangles)), work.lend(spheres), len(triangles)
    try:
        ids = _morton_order(work, scene, count)
        shapes = work.empty(np.float32, SHAPE * count)
        work.run_each("gather_shapes", count, *scene, ids, shapes)
    finally:
        work.finish()
    work.free(*scene[:2])
    return Primitives(shapes, ids, len(triangles), count)


def _morton_order(work: DataParallel, scene: Scene, count: int) -> cl.Buffer:
    """Return the primitives' numbers in Morton order, (count,) uint32."""
    low, extent = _centre_bounds(work, scene, count)
    scale = min(CELLS / extent, float(np.finfo(np.float32).max)) if extent > 0 else 0.0
    codes, ids = work.empty(np.uint64, count), work.empty(np.uint32, count)
    work.run_each("morton_codes", count, *scene, *low.tolist(), scale, codes, ids)
    codes, ids = radix_sort(work, codes, ids, count)
    work.free(codes)
    return ids


def radix_sort(work: DataParallel, codes: cl.Buffer, values: cl.Buffer, count: int) -> tuple[cl.Buffer, cl.Buffer]:
    """Sort codes, uint64 below 2^CODE_BITS, with their values, uint32; stable. Frees the given arrays."""
    tiles = work.tiles(count)
    digits = work.empty(np.uint32, tiles << DIGIT_BITS)
    other_codes, other_values = work.empty(np.uint64, count), work.empty(np.uint32, count)
    for shift in range(0, CODE_BITS, DIGIT_BITS):
        work.run_tiles("count_digits", count, codes, shift, digits)
        work.scan(digits, tiles << DIGIT_BITS)
        work.run_tiles("move_digits", count, codes, values, shift, digits, other_codes, other_values)
        codes, values, other_codes, other_values = other_codes, other_values, codes, values
    work.free(other_codes, other_values, digits)
    return codes, values


def _centre_bounds(work: DataParallel, scene: Scene, count: int) -> tuple[FloatArray, float]:
    """Return twice the minimum of the centres (3,) float32, and twice their largest extent."""
    tiles = work.tiles(count)
    partial = work.empty(np.float32, 6 * tiles)
    work.run_tiles("centre_bounds", count, *scene, partial)
    bounds = work.download(partial, np.float32, 6 * tiles).reshape(-1, 6)
    work.free(partial)
    low, high = bounds[:, :3].min(axis=0), bounds[:, 3:].max(axis=0)
    return low, float((high - low).max())
