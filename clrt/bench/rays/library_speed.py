"""clrt compared with other ray casting libraries: the same rays and triangles, in interleaved runs.

Kernels: only clrt's kernels against only Embree's functions. Calls: including the call from Python with numpy arrays.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from importlib import metadata
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import UsageError
from ...queries.mesh import RayQuery
from ..interleaved import Contestant, race
from .embree import EmbreeRays, EmbreeScene
from .ray_libraries import LIBRARIES, Call, clrt
from .ray_speed import Floats, Run
from .workloads import Faces, Mesh, Workload, closed_room, rotated_copies, subdivide, workloads

#: Embree configurations: robust scene, packet width, coherent flag.
EMBREE = {
    "embree 1": (False, 1, False),
    "embree 8": (False, 8, False),
    "embree 8 coherent": (False, 8, True),
    "embree 1 robust": (True, 1, False),
    "embree 8 robust": (True, 8, False),
    "embree 8 robust coherent": (True, 8, True),
}
SIZE, QUICK_SIZE = (800, 800), (256, 256)
LARGE, COPIES = 1_000_000, 20
#: Relative to the largest t: hits agree if their t differ by less.
TOLERANCE = 1e-5


def measure_peers(
    vertices: Floats, faces: Faces, *, quick: bool = False, device: str | int | None = None
) -> Iterator[dict[str, Any]]:
    """Yield the results of `clrt bench peers`, scene by scene. vertices: (n, 3); faces: (m, 3).

    trees: build seconds and bytes of each BVH; hits: the fraction of each kind of rays that hit; kernels, and in the
    first scene calls: for each kind the result of `race`; missing: why a library is not included.
    """
    for name, scene, target in _scenes(vertices, faces, quick):
        query = RayQuery(*scene, device=device)
        kinds = list(workloads(*scene, target, query.closest_hit, QUICK_SIZE if quick else SIZE))
        result = {
            "scene": name,
            "triangles": len(scene[1]),
            "device": query.device.info.name,
            "platform": query.device.info.platform,
            "device_type": query.device.info.type,
            "layout": query.tree.name,
            "sah_cost": query.tree.sah_cost,
            "hits": {kind.name: float(np.mean(query.any_hit(*kind.rays))) for kind in kinds},
            **_measure_kernels(scene, query, kinds),
        }
        if name == "room":
            calls, missing = _measure_calls(scene, query, kinds)
            result |= {"calls": calls, "missing": result["missing"] | missing}
        yield result


def versions() -> dict[str, str]:
    """Return the versions of clrt and the installed libraries."""
    packages = {"clrt", "trimesh", *(library.package for library in LIBRARIES.values())}
    return {each.name: each.version for each in metadata.distributions() if each.name in packages}


def _scenes(vertices: Floats, faces: Faces, quick: bool) -> Iterator[tuple[str, Mesh, Floats]]:
    """Yield name, triangles, and vertices to look at: the mesh in a room, its triangles subdivided, copies of it."""
    yield "room", closed_room(vertices, faces), vertices
    if quick:
        return
    fine = vertices, faces
    while len(fine[1]) < LARGE:
        fine = subdivide(*fine)
    yield "subdivided", closed_room(*fine), vertices
    copies = rotated_copies(vertices, faces, COPIES)
    yield f"{COPIES} copies", closed_room(*copies), copies[0]


def _measure_kernels(scene: Mesh, query: RayQuery, kinds: list[Workload]) -> dict[str, Any]:
    trees = {"clrt": {"seconds": query.tree.build_seconds, "bytes": query.tree.bytes}}
    missing, embree = {}, {}
    try:
        embree = {robust: EmbreeScene(*scene, robust=robust) for robust in (False, True)}
    except UsageError as error:
        missing["embree"] = str(error)
    kernels = {kind.name: race(_kernel_contestants(query, embree, kind)) for kind in kinds}
    for robust, tree in embree.items():
        trees["embree robust" if robust else "embree"] = {"seconds": tree.build_seconds, "bytes": tree.bytes}
        tree.close()
    return {"trees": trees, "kernels": kernels, "missing": missing}


def _kernel_contestants(query: RayQuery, embree: dict[bool, EmbreeScene], kind: Workload) -> dict[str, Contestant]:
    run = Run(query, query.any_hit if kind.any_hit else query.closest_hit, kind.rays)
    ours, count = run.answers, len(kind.rays[2])
    contestants = {"clrt": Contestant(run, count)}
    for name, (robust, width, coherent) in EMBREE.items() if embree else ():
        rays = EmbreeRays(embree[robust], kind.rays, any_hit=kind.any_hit, width=width, coherent=coherent)
        rays.trace()
        agrees = np.mean((rays.t < 0) == ours) if kind.any_hit else agreement(ours, rays.primitive, rays.t)
        contestants[name] = Contestant(rays.trace, count, float(agrees))
    return contestants


def _measure_calls(scene: Mesh, query: RayQuery, kinds: list[Workload]) -> tuple[dict[str, Any], dict[str, str]]:
    """Return the result of `race` for each kind of closest hits, and the missing libraries."""
    calls, missing = {"clrt": (clrt(query), len(kinds[0].rays[2]))}, {}
    for name, library in LIBRARIES.items():
        try:
            calls[name] = library.prepare(*scene), library.rays
        except ImportError:
            missing[name] = f"not installed (pip install {library.package})"
    return {kind.name: race(_call_contestants(query, calls, kind)) for kind in kinds if not kind.any_hit}, missing


def _call_contestants(query: RayQuery, calls: dict[str, tuple[Call, int]], kind: Workload) -> dict[str, Contestant]:
    """Return each call with as many rays as it can handle, an evenly spaced subset."""
    origins, directions, _ = kind.rays
    contestants = {}
    for name, (call, limit) in calls.items():
        few = slice(None, None, -(-len(origins) // limit))
        rays = np.ascontiguousarray(origins[few]), np.ascontiguousarray(directions[few])
        agrees = agreement(query.closest_hit(*rays), *call(*rays))
        contestants[name] = Contestant(partial(_timed_call, call, rays), len(rays[0]), agrees)
    return contestants


def _timed_call(call: Call, rays: tuple[Floats, Floats]) -> tuple[float, float]:
    start, processor = time.perf_counter(), time.process_time()
    call(*rays)
    return time.perf_counter() - start, time.process_time() - processor


def agreement(ours: NDArray[Any], primitive: NDArray[Any], t: Floats | None) -> float:
    """Return the fraction of rays whose hits are equivalent to ours: both miss, or hit at the same t (also near edges).

    ours: records of `RayQuery.closest_hit`; primitive, t: see `libraries`. Without t the triangle must be the same.
    """
    miss, hit = (ours["primitive"] < 0) & (primitive < 0), (ours["primitive"] >= 0) & (primitive >= 0)
    if t is None:
        return float(np.mean(ours["primitive"] == primitive))
    near = np.zeros_like(hit)
    near[hit] = np.abs(ours["t"][hit] - t[hit]) <= TOLERANCE * ours["t"].max(where=hit, initial=0)
    return float(np.mean(miss | near))
