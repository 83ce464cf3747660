"""Rays on numpy arrays through a tree that is on a device: the traversal of the renderer as a library."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import ArrayLike, NDArray

from .accel.kernels import tree_buffers, tree_defines, tree_files
from .accel.layouts import LANES, Layout
from .accel.wide import EMPTY
from .device.arrays import resident
from .device.launch import wait_for
from .device.open import Device
from .device.preamble import defines, scene_struct, typedefs
from .device.program import build, compose, make_kernel
from .device.records import record
from .errors import UsageError

HIT = record(t="f4", primitive="i4", u="f4", v="f4")
INSTANCE_HIT = record(t="f4", primitive="i4", u="f4", v="f4", instance="i4", pad="3i4")
COUNTS = record(triangles="i4", spheres="i4", pad="2i4")
#: Rays that are on the device at once: 44 bytes each.
CHUNK = 1 << 20
#: Ways through the layout bvh8: ray by ray, eight coherent ones together (kernels/traverse/packet.cl), many in turns.
TRAVERSALS = ("single", "packet", "pool")
#: Rays that a work-item has in its pool (kernels/traverse/pool.cl), and how many it answers in all.
POOL, SHARE = 16, 512
#: Rays are coherent if the mean cosine between one and the next is above this: a camera's are, reflected ones are not.
COHERENT, PAIRS = 0.9, 1024
Rays = tuple[NDArray[Any], NDArray[Any], NDArray[Any]]


class TreeQuery:
    """A tree on a device to shoot rays at. The answers do not depend on the device, the tree or the order of the rays.

    traversal: one of TRAVERSALS; None takes what was fastest for such rays: the pool, but packets where rays are
    coherent and the processor's cache holds the tree. Single rays with other layouts and on GPUs, and on a CPU
    whose driver does not tell its cache.
    kernel_seconds: the time of all kernels so far, without uploads and downloads.

    Of a ray, origins and directions are (n, 3), or (3,) for all; t_max is (n,) or one number, and t counts lengths of
    the direction. Of hits at the same t the lowest primitive comes first. A ray whose direction is zero, or that holds
    a NaN or infinity, meets nothing; t_max may be infinite. UsageError where the arrays do not fit.
    """

    def __init__(self, device: Device, tree: Layout, triangles: int, unit: float, triangle: str,
                 traversal: str | None) -> None:
        """Of a tree over so many triangles, whose lengths are multiplied by `unit`."""
        self.device = device
        self.kernel_seconds = 0.0
        self._hit = INSTANCE_HIT if "instances" in tree.buffers else HIT
        self._counts = np.zeros(1, COUNTS)
        self._counts["triangles"] = triangles
        self._triangle = triangle
        self._traversal = traversal if tree.name == "bvh8" and triangles else "single"
        if traversal not in (None, *TRAVERSALS):
            raise UsageError(f"there is no traversal {traversal!r}: take one of {', '.join(TRAVERSALS)}")
        self._kernels: dict[tuple[str, str, int], cl.Kernel] = {}
        self._use(tree, unit)

    def _use(self, tree: Layout, unit: float) -> None:
        """Takes the rays to this tree from now on, which is uploaded."""
        buffers = {name: resident(self.device, array) for name, array in tree.buffers.items()}
        self.tree, self.unit = replace(tree, buffers=buffers), unit
        self._scene = [array.buffer for array in buffers.values()]

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
            last = self._ask("next_hit", (o[index], d[index], t[index]), last.copy())
            index, last = index[last["primitive"] >= 0], last[last["primitive"] >= 0]
            if not len(index):
                break
            indices.append(index)
            hits.append(last)
        order = np.argsort(np.concatenate(indices), kind="stable")
        return np.concatenate(indices)[order], np.concatenate(hits)[order]

    def _ask(self, name: str, rays: Rays, answers: NDArray[Any]) -> NDArray[Any]:
        """`answers`, with what kernel query_`name` writes over it for the rays."""
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
        traversal = self._way(name, inputs[1])
        kernel, local = self._kernel(name, traversal), self.device.local_size
        kernel.set_args(*self._scene, self._counts[0], *buffers, output, np.float32(self.unit), np.uint32(n))
        groups = -(-n // ((SHARE if traversal == "pool" else self.device.lanes) * local))
        start = time.perf_counter()
        wait_for(cl.enqueue_nd_range_kernel(queue, kernel, (groups * local,), (local,)))
        self.kernel_seconds += time.perf_counter() - start
        wait_for(cl.enqueue_copy(queue, answers, output, is_blocking=False))

    def _way(self, name: str, directions: NDArray[np.float32]) -> str:
        """The traversal for these rays."""
        packets = self.device.lanes == LANES and self._triangle == "watertight" and self._hit is HIT
        if name == "next_hit" or (self._traversal == "packet" and not packets):
            return "single"
        if self._traversal is not None:
            return self._traversal
        cache = self.device.cl.global_mem_cache_size if self.device.info.type == "cpu" else 0
        if not cache:
            return "single"
        return "packet" if packets and self.tree.bytes < cache and _coherent(directions) else "pool"

    def _kernel(self, name: str, traversal: str) -> cl.Kernel:
        """The kernel query_`name`, built when it is first asked for."""
        key = name, traversal, tree_defines(self.tree)["STACK_SIZE"]
        if key not in self._kernels:
            self._kernels[key] = make_kernel(self.device, build(self.device, self.source(name, traversal)),
                                             f"query_{name}")
        return self._kernels[key]

    def source(self, name: str, traversal: str) -> str:
        """The program that answers `name`: closest_hit, any_hit or next_hit."""
        triangles, instances = bool(self._counts["triangles"][0]), self._hit is INSTANCE_HIT
        values = {"LANES": self.device.lanes, **tree_defines(self.tree)}
        values |= {"TRIANGLES": 1, "PRIMITIVES": 1} if triangles else {}
        values |= {"INSTANCES": 1} if instances else {}
        values |= {"NEXT_HIT": 1} if name == "next_hit" else {}
        values |= {"packet": {"PACKET_RAYS": 1, "EMPTY": EMPTY}, "single": {},
                   "pool": {"POOL": POOL, "SHARE": SHARE, "STOP_AT_FIRST": int(name == "any_hit")}}[traversal]
        preamble = "\n".join([defines(values), f"#define QUERY_NAME query_{name}",
                              typedefs({"Counts": COUNTS, "RayHit": self._hit}), scene_struct(tree_buffers(self.tree))])
        files = tree_files(self.tree.name, self._triangle, triangles, spheres=False, instances=instances)
        return compose(preamble, "query_pool.cl" if traversal == "pool" else "query.cl",
                       files | {"PACKETS": ["traverse/packet.cl"] if traversal == "packet" else []})


def _coherent(directions: NDArray[np.float32]) -> bool:
    """Whether rays (n, 3) run much like the ones before them, by a sample of pairs."""
    first = np.linspace(0, max(0, len(directions) - 2), PAIRS).astype(np.intp)[:len(directions) - 1]
    with np.errstate(all="ignore"):
        one, other = directions[first].astype(np.float64), directions[first + 1].astype(np.float64)
        cosine = (one * other).sum(1) / (np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1))
    return bool(np.nanmean(cosine) > COHERENT) if np.isfinite(cosine).any() else False


def _chunks(n: int) -> Iterator[slice]:
    for first in range(0, n, CHUNK):
        yield slice(first, min(n, first + CHUNK))


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
