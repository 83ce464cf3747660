"""Ray queries on numpy arrays against a BVH on a device: the renderer's traversal as a library."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import ArrayLike, NDArray

from ..accel.layouts import LANES, Layout
from ..accel.methods import HitTests
from ..accel.traversal_kernels import tree_defines
from ..device.launches.device_arrays import lent, on_host, resident
from ..device.launches.driver_loop_limits import loop_turns
from ..device.launches.launch import LaunchSize, run_seconds, wait_for
from ..device.launches.lent_memory import begin_copy, take_back
from ..device.open import Device, open_device
from ..device.programs.program import build, make_kernel
from ..errors import DeviceError, UsageError, check_choice
from ..float_errors import with_default_errors
from ..scene.geometry.ray_arrays import Rays, ray_arrays
from ..scene.geometry.scaling import SceneFrame
from .query_program import COUNTS, HIT, INSTANCE_HIT, QUERIES, SHARE, TRAVERSALS, hit_record, program_source

#: Maximum number of rays on the device at once, at 44 bytes each.
CHUNK = 1 << 20
#: Rays of the first launch, and minimum of any; later ones are sized to take device.launch.TARGET_SECONDS.
FIRST, FEWEST = 1 << 15, 1 << 12
#: Rays are coherent if the mean cosine between consecutive ones exceeds this; camera rays are, reflected ones are not.
COHERENT, PAIRS = 0.9, 1024
#: Attributes of a query that a copy creates anew.
ON_DEVICE = ("device", "_lock", "_kernels", "_scene")


class TreeQuery:
    """A BVH on a device to intersect with rays. Results do not depend on the device, the BVH or the order of the rays.

    traversal, for the layout bvh8: "single", "packet" (eight coherent rays together; single rays if unsupported: on
    GPUs, and for spheres and instances) or "pool" (many interleaved rays). None selects what was measured to be
    fastest: packets if the rays are coherent and the BVH fits the processor's cache, otherwise the pool; single rays
    with other layouts, on GPUs, and on CPUs whose driver does not report a cache size. kernel_seconds: the time of all
    kernels so far, without uploads and downloads; longest_launch: that of the longest.

    Origins and directions of rays are (n, 3), or (3,) for all; t_max is (n,) or one number, and t is in units of the
    direction's length. Of hits at the same t the lowest primitive comes first. A ray with a zero direction, NaN or
    infinity misses; t_max may be infinite. Raises UsageError if the shapes do not match. Threads may share a query, but
    not while its BVH changes; a process forked from one that has used OpenCL gets a UsageError. A copied or unpickled
    query opens its device by the same selector, and returns the same results.
    """

    def __init__(
        self,
        device: Device,
        tree: Layout,
        counts: tuple[int, int],
        frame: SceneFrame,
        tests: HitTests,
        traversal: str | None,
        selector: str | int | None = None,
    ) -> None:
        """Create a query for a BVH over `counts`, the numbers of triangles and spheres, in `frame`. selector: the
        argument that opened the device."""
        self.device, self._selector = device, selector
        self.kernel_seconds = self.longest_launch = 0.0
        self._sizes = {name: LaunchSize(FIRST) for name in QUERIES}
        self._counts = np.zeros(1, COUNTS)
        self._counts["triangles"], self._counts["spheres"] = counts
        self._tests = tests
        check_choice("traversal", traversal, (None, *TRAVERSALS))
        if traversal in ("packet", "pool") and tree.name != "bvh8":
            raise UsageError(f"the traversal {traversal} needs the layout bvh8, not {tree.name}; leave it out")
        self._traversal = traversal if tree.name == "bvh8" and any(counts) else "single"
        self._lock = threading.Lock()
        self._kernels: dict[tuple[str, str, int], cl.Kernel] = {}
        self._use(tree, frame)

    def __repr__(self) -> str:
        counts = ", ".join(f"{self._counts[name][0]} {name}" for name in ("triangles", "spheres"))
        return f"<{type(self).__name__}: {counts}; {self.tree.name} on {self.device.info.name}>"

    def __getstate__(self) -> dict[str, Any]:
        """Return the state that does not belong to the device, and the buffers as arrays."""
        state = {name: value for name, value in vars(self).items() if name not in ON_DEVICE}
        buffers = {name: on_host(self.device, array) for name, array in self.tree.buffers.items()}
        return {**state, "tree": replace(self.tree, buffers=buffers, work=self.tree.sah_cost)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the query on its device; raises DeviceError if that is not available."""
        vars(self).update(state)
        self.device, self._lock, self._kernels = open_device(self._selector), threading.Lock(), {}
        self._use(self.tree, self.frame)

    def _use(self, tree: Layout, frame: SceneFrame) -> None:
        """Upload a BVH and use it from now on."""
        buffers = {name: resident(self.device, array) for name, array in tree.buffers.items()}
        tree, scene = replace(tree, buffers=buffers), [array.buffer for array in buffers.values()]
        # all or none, if interrupted
        self.tree, self.frame, self._hit, self._scene = tree, frame, hit_record(tree), scene

    @with_default_errors
    def closest_hit(self, origins: ArrayLike, directions: ArrayLike, t_max: ArrayLike = np.inf) -> NDArray[Any]:
        """Return the first hit of each ray at 0 < t < t_max.

        As (n,) records of t float32, primitive int32, u and v float32; for a miss t is inf and primitive −1.
        The hit point is origin + t·direction = (1 − u − v)·p0 + u·p1 + v·p2. Test for hits by primitive >= 0: the t of
        a hit is inf, too, if it exceeds float32, as with directions of length 1e-40.
        """
        rays = ray_arrays(origins, directions, t_max)
        return _shown(self._ask("closest_hit", rays, np.empty(len(rays[2]), self._hit)))

    @with_default_errors
    def any_hit(self, origins: ArrayLike, directions: ArrayLike, t_max: ArrayLike = np.inf) -> NDArray[np.bool_]:
        """Return (n,) bool: whether anything is hit at 0 < t < t_max."""
        rays = ray_arrays(origins, directions, t_max)
        return self._ask("any_hit", rays, np.empty(len(rays[2]), np.bool_))

    @with_default_errors
    def all_hits(
        self, origins: ArrayLike, directions: ArrayLike, t_max: ArrayLike = np.inf, *, max_hits: int = 100
    ) -> tuple[NDArray[np.int64], NDArray[Any]]:
        """Return all hits at 0 < t < t_max, up to `max_hits` per ray: ray indices (k,), `closest_hit` records (k,).

        Sorted by ray, then t, then primitive. Each hit is found from the one before by comparing (t, primitive), not by
        moving the origin, so touching or coincident surfaces all count once each; but none behind a hit whose t exceeds
        float32 and is inf.
        """
        if not isinstance(max_hits, int | np.integer) or max_hits < 1:
            raise UsageError(f"max_hits is {max_hits!r}; it must be an integer of at least 1")
        o, d, t = ray_arrays(origins, directions, t_max)
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
        return np.concatenate(indices)[order], _shown(np.concatenate(hits)[order])

    def _ask(self, name: str, rays: Rays, answers: NDArray[Any]) -> NDArray[Any]:
        """Return `answers`, which the kernel query_`name` overwrites for the rays."""
        for part in self._parts(name, len(answers)):
            origins, directions, t_max = (array[part] for array in rays)
            if any(self.frame.center):
                origins = origins - np.array(self.frame.center)
            with np.errstate(over="ignore"):
                inputs = [np.ascontiguousarray(array, np.float32) for array in (origins, directions, t_max)]
            self._ask_chunk(name, inputs, answers[part])
            self._check_loops(answers[part])
        return answers

    def _check_loops(self, answers: NDArray[Any]) -> None:
        """Raise DeviceError if the driver ended loops before they had a result (kernels/query/query.cl)."""
        turns = loop_turns(self.device)
        if turns is None:
            return
        ended = answers["primitive"] == -2 if answers.dtype.names else answers.view(np.uint8) == 2
        if ended.any():
            raise DeviceError(
                f"{self.device.info.name} ({self.device.info.platform}): the driver ends every loop of a "
                f"work-item after {turns} iterations, and {np.count_nonzero(ended)} of {len(answers)} "
                f"rays need more in the layout {self.tree.name}; use another device or layout"
            )

    def _parts(self, name: str, n: int) -> Iterator[slice]:
        """Yield slices of n rays, one per launch."""
        first = 0
        while first < n:
            size = min(CHUNK, max(FEWEST, self._sizes[name].units))
            yield slice(first, min(n, first + size))
            first += size

    def _ask_chunk(self, name: str, inputs: list[NDArray[np.float32]], answers: NDArray[Any]) -> None:
        """Overwrite `answers`; a CPU works on the arrays in place."""
        n = len(answers)
        buffers, output = [lent(self.device, array) for array in inputs], lent(self.device, answers, writable=True)
        traversal = self._way(name, inputs[1])
        kernel, local = self._kernel(name, traversal), self.device.local_size
        groups = -(-n // ((SHARE if traversal == "pool" else self.device.lanes) * local))
        start = time.perf_counter()
        with self._lock:  # another thread must not set arguments in between
            kernel.set_args(*self._scene, self._counts[0], *buffers, output, np.float32(self.frame.unit), np.uint32(n))
            launched = cl.enqueue_nd_range_kernel(self.device.queue, kernel, (groups * local,), (local,))
        wait_for(launched)
        seconds = run_seconds(launched) or time.perf_counter() - start
        self.kernel_seconds += seconds
        self.longest_launch = max(self.longest_launch, seconds)
        self._sizes[name].learn(n, seconds)
        wait_for(begin_copy(self.device, answers, output))
        take_back(*buffers, output)

    def _way(self, name: str, directions: NDArray[np.float32]) -> str:
        """Return the traversal for these rays."""
        packets = (
            self.device.lanes == LANES
            and self._tests.triangle == "watertight"
            and self._hit is HIT
            and not self._counts["spheres"]
        )
        if name == "next_hit" or loop_turns(self.device) is not None or (self._traversal == "packet" and not packets):
            return "single"
        if self._traversal is not None:
            return self._traversal
        cache = self.device.cl.global_mem_cache_size if self.device.info.type == "cpu" else 0
        if not cache:
            return "single"
        return "packet" if packets and self.tree.bytes < cache and _coherent(directions) else "pool"

    def _kernel(self, name: str, traversal: str) -> cl.Kernel:
        """Return the kernel for `name`, built on first use."""
        key = name, traversal, tree_defines(self.tree)["STACK_SIZE"]
        if key not in self._kernels:
            program = build(self.device, self.source(name, traversal), self.tree.bytes)
            self._kernels[key] = make_kernel(
                self.device, program, "query_pool" if traversal == "pool" else f"query_{name}"
            )
        return self._kernels[key]

    def source(self, name: str, traversal: str) -> str:
        """Return the source of the program for `name`, one of QUERIES, and a traversal of TRAVERSALS."""
        return program_source(
            name,
            traversal,
            self.tree,
            (bool(self._counts["triangles"]), bool(self._counts["spheres"])),
            self._tests,
            self.device.lanes,
            loop_turns(self.device) is not None,
        )


def _shown(hits: NDArray[Any]) -> NDArray[Any]:
    """Return the records without padding."""
    return hits[[name for name in hits.dtype.names or () if name != "pad"]]


def _coherent(directions: NDArray[np.float32]) -> bool:
    """Return whether consecutive rays (n, 3) have similar directions, from a sample of pairs."""
    if len(directions) < 2:
        return False
    first = np.linspace(0, max(0, len(directions) - 2), PAIRS).astype(np.intp)[: len(directions) - 1]
    with np.errstate(all="ignore"):
        one, other = directions[first].astype(np.float64), directions[first + 1].astype(np.float64)
        cosine = (one * other).sum(1) / (np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1))
    return bool(np.nanmean(cosine) > COHERENT) if np.isfinite(cosine).any() else False
