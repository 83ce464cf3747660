"""Ray queries on numpy arrays: the traversal of the renderer as a library."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import ArrayLike, NDArray

from .accel.build import build_tree
from .accel.kernels import tree_buffers, tree_defines, tree_files
from .accel.layouts import Layout
from .device.arrays import on_device
from .device.launch import wait_for
from .device.open import Device, open_device
from .device.preamble import defines, scene_struct, typedefs
from .device.program import build, compose, make_kernel
from .device.records import record
from .errors import SceneError, UsageError
from .scene.scaling import unit_for

HIT = record(t="f4", primitive="i4", u="f4", v="f4")
INSTANCE_HIT = record(t="f4", primitive="i4", u="f4", v="f4", instance="i4", pad="3i4")
COUNTS = record(triangles="i4", spheres="i4", pad="2i4")
#: Rays that are on the device at once: 44 bytes each.
CHUNK = 1 << 20
#: Rays that a work-item keeps in flight on a CPU (kernels/traverse/pool.cl), and how many it answers in all.
IN_FLIGHT, SHARE = 16, 512
Rays = tuple[NDArray[Any], NDArray[Any], NDArray[Any]]


class RayQuery:
    """Triangles to shoot rays at. The answers do not depend on the device, the tree or the order of the rays.

    vertices: (n, 3) float32; faces: (m, 3) int32. device, layout, builder, triangle: as in `Renderer`.
    in_flight: rays that a work-item keeps in flight, 1 to answer one after another; only with the layout bvh8.
    kernel_seconds: the time of all kernels so far, without uploads and downloads.
    Raises SceneError for arrays of other shapes, vertices that are not finite and indices out of range.

    Of a ray, origins and directions are (n, 3), or (3,) for all; t_max is (n,) or one number, and t counts lengths of
    the direction. Of hits at the same t the lowest primitive comes first. A ray whose direction is zero, or that holds
    a NaN or infinity, meets nothing; t_max may be infinite. UsageError where the arrays do not fit.
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike, *, device: str | int | None = None,
                 layout: str | None = None, builder: str | None = None, triangle: str = "watertight",
                 in_flight: int = IN_FLIGHT) -> None:
        triangles = corners(vertices, faces)
        unit = unit_for(float(np.abs(triangles).max(initial=0)))
        opened = open_device(device)
        tree = build_tree(opened, layout or opened.layout, builder, (triangles * np.float64(unit)).astype(np.float32))
        self._prepare(opened, tree, len(triangles), unit, triangle, in_flight)

    def _prepare(self, device: Device, tree: Layout, triangles: int, unit: float, triangle: str,
                 in_flight: int) -> None:
        """Uploads the tree over so many triangles, whose lengths are multiplied by `unit`."""
        self.device, self.tree, self.unit = device, tree, unit
        self.kernel_seconds = 0.0
        self._hit = INSTANCE_HIT if "instances" in tree.buffers else HIT
        self._counts = np.zeros(1, COUNTS)
        self._counts["triangles"] = triangles
        self._triangle = triangle
        self._in_flight = in_flight if tree.name == "bvh8" and triangles else 1
        self._kernels: dict[str, cl.Kernel] = {}
        self._scene = [on_device(device, array) for array in tree.buffers.values()]

    def closest_hit(self, origins: ArrayLike, directions: ArrayLike, t_max: ArrayLike = np.inf) -> NDArray[Any]:
        """(n,) records of t float32 (inf: a miss), primitive int32 (−1), u, v float32: the first at 0 < t < t_max.

        The hit point is origin + t·direction = (1 − u − v)·p0 + u·p1 + v·p2.
        """
        rays = _rays(origins, directions, t_max)
        return self._ask("closest_hit", rays, np.empty(len(rays[2]), self._hit))

    def any_hit(self, origins: ArrayLike, directions: ArrayLike, t_max: ArrayLike = np.inf) -> NDArray[np.bool_]:
        """(n,) bool: whether anything lies at 0 < t < t_max."""
        rays = _rays(origins, directions, t_max)
        return self._ask("any_hit", rays, np.empty(len(rays[2]), np.bool_))

    def all_hits(self, origins: ArrayLike, directions: ArrayLike, t_max: ArrayLike = np.inf, *,
                 max_hits: int = 100) -> tuple[NDArray[np.int64], NDArray[Any]]:
        """Every hit at 0 < t < t_max, up to `max_hits` a ray: (k,) indices of rays, and (k,) records of `closest_hit`.

        Sorted by ray, then t, then primitive. Each hit is found from the one before by comparing (t, primitive), not
        by moving the origin, so surfaces that touch or coincide all count, once each.
        """
        if max_hits < 1:
            raise UsageError(f"max_hits is {max_hits}; it must be at least 1")
        o, d, t = _rays(origins, directions, t_max)
        index = np.arange(len(t))
        last = np.zeros(len(t), self._hit)
        last["primitive"] = -1
        if self._hit is INSTANCE_HIT:
            last["instance"] = -1
        indices, hits = [index[:0]], [last[:0]]
        for _ in range(max_hits):
            last = self._ask("next_hit", (o[index], d[index], t[index]), last)
            index, last = index[last["primitive"] >= 0], last[last["primitive"] >= 0]
            if not len(index):
                break
            indices.append(index)
            hits.append(last)
        order = np.argsort(np.concatenate(indices), kind="stable")
        return np.concatenate(indices)[order], np.concatenate(hits)[order]

    def _ask(self, name: str, rays: Rays, answers: NDArray[Any]) -> NDArray[Any]:
        """A new array like `answers`, with what kernel query_`name` writes over it for the rays."""
        answers = answers.copy()
        for part in _chunks(len(answers)):
            inputs = [np.ascontiguousarray(array[part], np.float32) for array in rays]
            self._ask_chunk(name, inputs, answers[part])
        return answers

    def _ask_chunk(self, name: str, inputs: list[NDArray[np.float32]], answers: NDArray[Any]) -> None:
        """Writes over `answers`; a CPU works on the arrays themselves."""
        n, context, queue, flags = len(answers), self.device.context, self.device.queue, cl.mem_flags
        source = flags.USE_HOST_PTR if self.device.info.type == "cpu" else flags.COPY_HOST_PTR
        buffers = [cl.Buffer(context, flags.READ_ONLY | source, hostbuf=array) for array in inputs]
        output = cl.Buffer(context, flags.READ_WRITE | source, hostbuf=answers)
        kernel, local = self._kernel(name), self.device.local_size
        kernel.set_args(*self._scene, self._counts[0], *buffers, output, np.float32(self.unit), np.uint32(n))
        groups = -(-n // (self._rays_a_work_item(name) * local))
        start = time.perf_counter()
        wait_for(cl.enqueue_nd_range_kernel(queue, kernel, (groups * local,), (local,)))
        self.kernel_seconds += time.perf_counter() - start
        wait_for(cl.enqueue_copy(queue, answers, output, is_blocking=False))

    def _pooled(self, name: str) -> bool:
        return self._in_flight > 1 and name != "next_hit"

    def _rays_a_work_item(self, name: str) -> int:
        return SHARE if self._pooled(name) else self.device.lanes

    def _kernel(self, name: str) -> cl.Kernel:
        """The kernel query_`name`, built when it is first asked for."""
        if name not in self._kernels:
            self._kernels[name] = make_kernel(self.device, build(self.device, self.source(name)), f"query_{name}")
        return self._kernels[name]

    def source(self, name: str) -> str:
        """The program that answers `name`: closest_hit, any_hit or next_hit."""
        triangles, instances = bool(self._counts["triangles"][0]), self._hit is INSTANCE_HIT
        values = {"LANES": self.device.lanes, **tree_defines(self.tree)}
        values |= {"TRIANGLES": 1, "PRIMITIVES": 1} if triangles else {}
        values |= {"INSTANCES": 1} if instances else {}
        values |= {"NEXT_HIT": 1} if name == "next_hit" else {}
        if self._pooled(name):
            values |= {"POOL": self._in_flight, "SHARE": SHARE, "STOP_AT_FIRST": int(name == "any_hit")}
        preamble = "\n".join([defines(values), f"#define QUERY_NAME query_{name}",
                              typedefs({"Counts": COUNTS, "RayHit": self._hit}), scene_struct(tree_buffers(self.tree))])
        return compose(preamble, "query_pool.cl" if self._pooled(name) else "query.cl",
                       tree_files(self.tree.name, self._triangle, triangles, spheres=False, instances=instances))


def _chunks(n: int) -> Iterator[slice]:
    for first in range(0, n, CHUNK):
        yield slice(first, min(n, first + CHUNK))


def corners(vertices: ArrayLike, faces: ArrayLike) -> NDArray[np.float32]:
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


def _rays(origins: ArrayLike, directions: ArrayLike, t_max: ArrayLike) -> Rays:
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
    return np.broadcast_to(o, (*n, 3)), np.broadcast_to(d, (*n, 3)), np.broadcast_to(t, n)
