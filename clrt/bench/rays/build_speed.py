"""BVH builders: build time, quality and memory by number of triangles, and the traversal speed of the results."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ...accel.build import build_tree
from ...accel.builders import BUILDERS
from ...accel.layouts import Layout
from ...accel.traversal_kernels import BUILDER_NAMES
from ...device.open import Device, open_device
from ...errors import UsageError
from ...queries.mesh import RayQuery
from ...scene.geometry.scaling import unit_for
from ..interleaved import Contestant, race
from .cold_start import measure_fresh
from .embree import EmbreeScene
from .line_fit import fit_logarithm
from .ray_speed import Floats, Run
from .resize import resized
from .workloads import Faces, Mesh, Workload, closed_room, workloads

#: Numbers of triangles, two per decade.
SIZES, QUICK_SIZES = [round(10 ** (k / 2)) for k in range(8, 15)], [1_000, 4_000, 16_000]
#: Most triangles for the numpy builders, which take up to half a minute for a million.
MOST_IN_NUMPY = 1_100_000
REFERENCE, EMBREE = "sah", "embree"
#: Builds per builder after a first call, and the total seconds after which a builder is not run again.
ROUNDS, SECONDS = 5, 15.0
KINDS = ("primary", "bounce", "shadow")
RAYS, QUICK_RAYS = (512, 512), (64, 64)


def measure_build(
    vertices: Floats, faces: Faces, *, quick: bool = False, device: str | int | None = None
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the results of `clrt bench build`, part by part, for the mesh (n, 3), (m, 3) in a closed room.

    size: see `measure_builders`, for each number of triangles; rays: see `measure_growth`; fresh: `measure_fresh` with
    the first builder that supports the largest size, for the smallest mesh with an empty program cache (`compiled`) and
    once more (`cached`), and for the `largest` mesh.
    """
    opened = open_device(device)
    queries: dict[int, RayQuery] = {}
    kinds: dict[int, list[Workload]] = {}
    smallest = None
    for size in QUICK_SIZES if quick else SIZES:
        scene = closed_room(*resized(vertices, faces, size))
        built = measure_builders(scene, opened)
        yield "size", built
        query = RayQuery(*scene, device=device)
        rays = workloads(*scene, vertices, query.closest_hit, QUICK_RAYS if quick else RAYS)
        queries[len(scene[1])], kinds[len(scene[1])] = query, [kind for kind in rays if kind.name in KINDS]
        largest = scene, kinds[len(scene[1])][0].rays
        smallest = smallest or largest
    yield "rays", measure_growth(queries, kinds)
    del query
    queries.clear()
    options = {"device": device, "builder": next(iter(built["builders"]))}
    with TemporaryDirectory() as cache:
        fresh = {name: measure_fresh(*(smallest or largest), Path(cache), **options) for name in ("compiled", "cached")}
    yield "fresh", fresh | {"largest": measure_fresh(*largest, **options)}


def measure_builders(scene: Mesh, device: Device) -> dict[str, Any]:
    """Measure the builders that support the device's layout, and Embree if it is installed, on one mesh.

    `builders` by name: seconds (median), first_seconds (of the first call, including all preparation), mtriangles (per
    second), bytes_per_triangle (persistent); except for Embree: peak_bytes_per_triangle (peak device memory of a
    builder on the device), sah_cost, cost_ratio (to REFERENCE's), nodes, depth, stack.
    """
    triangles = scene[0][scene[1]]
    triangles *= np.float32(unit_for(float(np.abs(triangles).max())))
    figures, builds = {}, {}
    for name, build in _builds(scene, triangles, device).items():
        start = time.perf_counter()
        try:
            seconds, facts = build()
        except UsageError:
            continue  # not every builder supports every layout, and Embree may be missing
        builds[name] = build
        figures[name] = {"seconds": seconds, "first_seconds": time.perf_counter() - start, **facts}
    for name, seconds in _in_turns(builds).items():
        figures[name] |= {"seconds": seconds, "mtriangles": 1e-6 * len(triangles) / seconds}
        if REFERENCE in figures and name != EMBREE:
            figures[name]["cost_ratio"] = figures[name]["sah_cost"] / figures[REFERENCE]["sah_cost"]
    return {
        "device": device.info.name,
        "platform": device.info.platform,
        "triangles": len(triangles),
        "layout": device.layout,
        "builders": figures,
    }


Build = Callable[[], tuple[float, dict[str, Any]]]


def _builds(scene: Mesh, triangles: Floats, device: Device) -> dict[str, Build]:
    """Return functions that build a BVH once and return the seconds and further properties."""

    def ours(name: str) -> tuple[float, dict[str, Any]]:
        tree = build_tree(device, device.layout, name, triangles)
        return tree.build_seconds, _facts(tree, len(triangles))

    def embree() -> tuple[float, dict[str, Any]]:
        tree = EmbreeScene(*scene)
        tree.close()
        return tree.build_seconds, {"bytes_per_triangle": tree.bytes / len(triangles)}

    names = [name for name in BUILDER_NAMES if name not in BUILDERS or len(triangles) <= MOST_IN_NUMPY]
    return {**{name: partial(ours, name) for name in names}, EMBREE: embree}


def _facts(tree: Layout, count: int) -> dict[str, Any]:
    return {
        "sah_cost": tree.sah_cost,
        "nodes": tree.nodes,
        "depth": tree.depth,
        "stack": tree.stack,
        "bytes_per_triangle": tree.bytes / count,
        "peak_bytes_per_triangle": tree.peak_bytes / count or None,
    }


def _in_turns(builds: dict[str, Build]) -> dict[str, float]:
    """Return the median seconds of each builder, from interleaved runs."""
    taken: dict[str, list[float]] = {name: [] for name in builds}
    for _ in range(ROUNDS):
        for name, build in builds.items():
            if sum(taken[name]) < SECONDS:
                taken[name].append(build()[0])
    return {name: median(seconds) for name, seconds in taken.items()}


def measure_growth(queries: dict[int, RayQuery], kinds: dict[int, list[Workload]]) -> dict[str, Any]:
    """Measure rays through BVHs of different sizes, in interleaved runs. queries, kinds: by number of triangles.

    kinds: for each kind of rays the result of `race` by size; fits: for each kind, `fit_logarithm` of seconds per ray.
    """
    races, fits = {}, {}
    for each in zip(*kinds.values()):
        runs = {
            size: Run(query, query.any_hit if kind.any_hit else query.closest_hit, kind.rays)
            for (size, query), kind in zip(queries.items(), each)
        }
        name = each[0].name
        races[name] = race({str(size): Contestant(run, len(run.answers)) for size, run in runs.items()}, ROUNDS)
        fits[name] = fit_logarithm(list(queries), [1e-6 / row["mrays"] for row in races[name].values()])
    return {"device_type": next(iter(queries.values())).device.info.type, "kinds": races, "fits": fits}
