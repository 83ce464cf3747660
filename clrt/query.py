"""Ray queries on numpy arrays: the traversal of the renderer as a library."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import ArrayLike, NDArray

from .accel.kernels import tree_buffers, tree_defines, tree_files
from .accel.layouts import pack
from .device.launch import wait_for
from .device.open import open_device
from .device.preamble import defines, scene_struct, typedefs
from .device.program import build, compose, make_kernel
from .device.records import record
from .errors import SceneError, UsageError
from .scene.scaling import unit_for

HIT = record(t="f4", primitive="i4", u="f4", v="f4")
COUNTS = record(triangles="i4", spheres="i4", pad="2i4")
#: Rays that are on the device at once: 44 bytes each.
CHUNK = 1 << 20


class RayQuery:
    """Triangles to shoot rays at. The answers do not depend on the device, the tree or the order of the rays.

    vertices: (n, 3) float32; faces: (m, 3) int32. device, layout, builder, triangle: as in `Renderer`.
    Raises SceneError for arrays of other shapes, vertices that are not finite and indices out of range.
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike, *, device: str | int | None = None,
                 layout: str | None = None, builder: str = "sah", triangle: str = "watertight") -> None:
        triangles = _triangles(vertices, faces)
        self.unit = unit_for(float(np.abs(triangles).max(initial=0)))
        triangles = (triangles * np.float64(self.unit)).astype(np.float32)
        self.device = open_device(device)
        self.tree = pack(layout or self.device.layout, builder, triangles, np.zeros((0, 4), np.float32))
        buffers = tree_buffers(self.tree)
        features = {"TRIANGLES": 1, "PRIMITIVES": 1} if len(triangles) else {}
        preamble = "\n".join([defines({"LANES": self.device.lanes, **tree_defines(self.tree), **features}),
                              typedefs({"Counts": COUNTS, "RayHit": HIT}), scene_struct(buffers)])
        source = compose(preamble, "query.cl", tree_files(self.tree.name, triangle, bool(len(triangles)), False))
        program = build(self.device, source)
        self._kernels = {name: make_kernel(self.device, program, f"query_{name}")
                         for name in ("closest_hit", "any_hit")}
        flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
        counts = np.zeros(1, COUNTS)
        counts["triangles"] = len(triangles)
        self._scene = [cl.Buffer(self.device.context, flags, hostbuf=array) for _, array in buffers.values()]
        self._counts = counts[0]

    def closest_hit(self, origins: ArrayLike, directions: ArrayLike, t_max: ArrayLike = np.inf) -> NDArray[Any]:
        """(n,) records of t float32 (inf: a miss), primitive int32 (−1), u, v float32: the first at 0 < t < t_max.

        origins, directions: (n, 3), or (3,) for all; t_max: (n,) or one number, in lengths of the direction. The hit
        point is origin + t·direction = (1 − u − v)·p0 + u·p1 + v·p2. Of hits at the same t the lowest primitive wins.
        A ray whose direction is zero, or that holds a NaN or infinity, meets nothing.
        """
        return self._ask("closest_hit", HIT, origins, directions, t_max)

    def any_hit(self, origins: ArrayLike, directions: ArrayLike, t_max: ArrayLike = np.inf) -> NDArray[np.bool_]:
        """(n,) bool: whether anything lies at 0 < t < t_max. The arguments are those of `closest_hit`."""
        return self._ask("any_hit", np.dtype(np.bool_), origins, directions, t_max)

    def _ask(self, name: str, answer: np.dtype[Any], origins: ArrayLike, directions: ArrayLike,
             t_max: ArrayLike) -> NDArray[Any]:
        rays = _rays(origins, directions, t_max)
        n = len(rays[2])
        answers = np.empty(n, answer)
        for part in _chunks(n):
            answers[part] = self._ask_chunk(name, answer, [np.ascontiguousarray(a[part], np.float32) for a in rays])
        return answers

    def _ask_chunk(self, name: str, answer: np.dtype[Any], rays: list[NDArray[np.float32]]) -> NDArray[Any]:
        n, context, queue = len(rays[2]), self.device.context, self.device.queue
        flags = cl.mem_flags
        inputs = [cl.Buffer(context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=array) for array in rays]
        output = cl.Buffer(context, flags.WRITE_ONLY, n * answer.itemsize)
        kernel, local = self._kernels[name], self.device.local_size
        kernel.set_args(*self._scene, self._counts, *inputs, output, np.float32(self.unit), np.uint32(n))
        groups = -(-n // (self.device.lanes * local))
        wait_for(cl.enqueue_nd_range_kernel(queue, kernel, (groups * local,), (local,)))
        answers = np.empty(n, answer)
        wait_for(cl.enqueue_copy(queue, answers, output, is_blocking=False))
        return answers


def _chunks(n: int) -> Iterator[slice]:
    for first in range(0, n, CHUNK):
        yield slice(first, min(n, first + CHUNK))


def _triangles(vertices: ArrayLike, faces: ArrayLike) -> NDArray[np.float32]:
    """(m, 3, 3) float32 corners; SceneError for what is no mesh."""
    points, indices = np.asarray(vertices, np.float32), np.asarray(faces)
    if points.ndim != 2 or points.shape[1] != 3 or indices.ndim != 2 or indices.shape[1] != 3:
        raise SceneError(f"vertices {points.shape} and faces {indices.shape} must have shapes (n, 3) and (m, 3)")
    if indices.size and indices.dtype.kind not in "iu":
        raise SceneError(f"faces has dtype {indices.dtype}; write whole numbers, such as int32")
    if not np.isfinite(points).all():
        row = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise SceneError(f"vertices[{row}] = {points[row].tolist()} is not finite; repair the mesh")
    outside = (indices < 0) | (indices >= len(points))
    if outside.any():
        face = int(np.argmax(outside.any(axis=1)))
        raise SceneError(f"faces[{face}] = {indices[face].tolist()}: there are {len(points)} vertices; repair the mesh")
    return points[indices.astype(np.intp).reshape(-1, 3)]


def _rays(origins: ArrayLike, directions: ArrayLike, t_max: ArrayLike) -> list[NDArray[np.floating[Any]]]:
    """The three arrays, broadcast to the same number of rays; UsageError where they do not fit."""
    o, d, t = np.asarray(origins), np.asarray(directions), np.asarray(t_max)
    try:
        shape = np.broadcast_shapes(o.shape[:-1], d.shape[:-1], t.shape)
    except ValueError:
        shape = None
    if o.shape[-1:] != (3,) or d.shape[-1:] != (3,) or shape is None or len(shape) > 1:
        raise UsageError(f"origins {o.shape}, directions {d.shape} and t_max {t.shape} must have shapes (n, 3), (n, 3) "
                         "and (n,), or stand for all rays with (3,) or one number")
    n = shape or (1,)
    return [np.broadcast_to(o, (*n, 3)), np.broadcast_to(d, (*n, 3)), np.broadcast_to(t, n)]
