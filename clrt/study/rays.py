"""Rays a second: closest hits and shadow rays of one mesh, the kernels alone and whole calls from Python."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from ..query import RayQuery
from ..scene.meshes import read_mesh

Floats = NDArray[np.float32]
Rays = tuple[Floats, Floats, Floats]


def measure_rays(vertices: Floats, faces: NDArray[np.int32], rays: Rays, *, repeats: int = 7,
                 **options: Any) -> dict[str, Any]:
    """The figures of `clrt bench rays`: medians of `repeats` calls after one to warm up.

    vertices: (n, 3); faces: (m, 3); rays: origins (k, 3), directions (k, 3), t_max (k,). options: see RayQuery.
    """
    start = time.perf_counter()
    query = RayQuery(vertices, faces, **options)
    build_seconds = time.perf_counter() - start
    closest, any_ = (_timed(query, call, rays, repeats) for call in (query.closest_hit, query.any_hit))
    count = len(rays[2]) / 1e6
    return {"device": query.device.info.name, "platform": query.device.info.platform, "layout": query.tree.name,
            "triangles": len(faces), "rays": len(rays[2]),
            "build_seconds": build_seconds, "tree_seconds": query.tree.build_seconds, "sah_cost": query.tree.sah_cost,
            "bytes_per_triangle": query.tree.bytes / max(1, len(faces)),
            "mrays_closest": count / closest["kernel"], "mrays_any": count / any_["kernel"],
            "mrays_closest_call": count / closest["call"], "mrays_any_call": count / any_["call"],
            "hits": int(np.count_nonzero(query.closest_hit(*rays)["primitive"] >= 0))}


def load_rays(path: Path) -> Rays:
    """origins (k, 3), directions (k, 3) and t_max (k,), float32, of an .npz file; SceneError for what is none."""
    try:
        with np.load(path) as stored:
            names = ("origins", "directions", "t_max")
            origins, directions, t_max = (stored[name].astype(np.float32) for name in names)
    except (OSError, ValueError, KeyError) as error:
        raise SceneError(f"{path}: cannot be read as rays: {error}; store origins, directions and t_max "
                         "with numpy.savez") from error
    return origins, directions, t_max


def load_triangles(path: Path) -> tuple[Floats, NDArray[np.int32]]:
    """All meshes of a model file as one: vertices (n, 3), faces (m, 3)."""
    vertices, faces, first = [], [], 0
    for mesh in read_mesh(path, "flat"):
        vertices.append(mesh.vertices)
        faces.append(mesh.faces + np.int32(first))
        first += len(mesh.vertices)
    return np.concatenate(vertices), np.concatenate(faces)


def scattered_rays(vertices: Floats, count: int = 1 << 20, seed: int = 0) -> Rays:
    """Rays from all around a mesh through its box: half of them start inside it, in random directions."""
    rng = np.random.default_rng(seed)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    inside = rng.uniform(low, high, (count, 3))
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    back = np.where(np.arange(count) % 2, np.linalg.norm(high - low), 0.0)[:, None]
    return ((inside - back * directions).astype(np.float32), directions.astype(np.float32),
            np.full(count, np.inf, np.float32))


def _timed(query: RayQuery, call: Callable[..., Any], rays: Rays, repeats: int) -> dict[str, float]:
    """Median seconds of whole calls and of their kernels."""
    call(*rays)
    seconds: dict[str, list[float]] = {"call": [], "kernel": []}
    for _ in range(repeats):
        kernel, start = query.kernel_seconds, time.perf_counter()
        call(*rays)
        seconds["call"].append(time.perf_counter() - start)
        seconds["kernel"].append(query.kernel_seconds - kernel)
    return {name: median(values) for name, values in seconds.items()}
