"""Ray throughput: closest hits and shadow rays of one mesh, the kernels alone and calls from Python."""

from __future__ import annotations

import time
import zlib
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError, UsageError
from ...formats.models import read_mesh
from ...queries.mesh import RayQuery
from ...scene.geometry.ray_arrays import ray_arrays

Floats = NDArray[np.float32]
Rays = tuple[Floats, Floats, Floats]


class Run:
    """Calls of one method of a query with the same rays. answers: results of a first call, for warm-up; calls: seconds
    of each later call, including conversion from and to numpy arrays."""

    def __init__(self, query: RayQuery, ask: Callable[..., NDArray[Any]], rays: Rays) -> None:
        self._query, self._ask, self._rays = query, ask, rays
        self.answers = ask(*rays)
        self.calls: list[float] = []

    def __call__(self) -> tuple[float, float]:
        """Return the kernels' seconds, and processor seconds of all threads except this one."""
        kernel, others, start = self._query.kernel_seconds, _others(), time.perf_counter()
        self._ask(*self._rays)
        self.calls.append(time.perf_counter() - start)
        return self._query.kernel_seconds - kernel, _others() - others


def measure_rays(
    vertices: Floats, faces: NDArray[np.int32], rays: Rays, *, repeats: int = 7, **options: Any
) -> dict[str, Any]:
    """Return the results of `clrt bench rays` with rays from a file: medians of `repeats` calls after a warm-up call.

    vertices: (n, 3); faces: (m, 3); rays: origins (k, 3), directions (k, 3), t_max (k,). options: see RayQuery.
    """
    start = time.perf_counter()
    query = RayQuery(vertices, faces, **options)
    build_seconds = time.perf_counter() - start
    closest, any_ = Run(query, query.closest_hit, rays), Run(query, query.any_hit, rays)
    kernels = [median(run()[0] for _ in range(repeats)) for run in (closest, any_)]
    count = len(rays[2]) / 1e6
    return {
        "device": query.device.info.name,
        "platform": query.device.info.platform,
        "layout": query.tree.name,
        "triangles": len(faces),
        "rays": len(rays[2]),
        "build_seconds": build_seconds,
        "tree_seconds": query.tree.build_seconds,
        "sah_cost": query.tree.sah_cost,
        "bytes_per_triangle": query.tree.bytes / max(1, len(faces)),
        "mrays_closest": count / kernels[0],
        "mrays_any": count / kernels[1],
        "mrays_closest_call": count / median(closest.calls),
        "mrays_any_call": count / median(any_.calls),
        "hits": int(np.count_nonzero(closest.answers["primitive"] >= 0)),
    }


def load_rays(path: Path) -> Rays:
    """Read origins (k, 3), directions (k, 3) and t_max (k,), float32, from an .npz file with arrays as for `RayQuery`.

    Raises SceneError if it is malformed or empty.
    """
    remedy = "store origins, directions and t_max with numpy.savez"
    try:
        with np.load(path) as stored, np.errstate(over="ignore"):
            rays = ray_arrays(*(stored[name] for name in ("origins", "directions", "t_max")))
            origins, directions, t_max = (np.ascontiguousarray(array, np.float32) for array in rays)
    except OSError as error:
        raise SceneError(f"{path}: cannot be read ({error.strerror or error})") from error
    except UsageError as error:
        raise SceneError(f"{path}: {error}") from error
    except KeyError as error:
        raise SceneError(f"{path}: {error.args[0]}; {remedy}") from error
    except (BadZipFile, EOFError, TypeError, ValueError, zlib.error) as error:
        raise SceneError(f"{path}: is not an .npz file of arrays; {remedy}") from error
    if not len(t_max):
        raise SceneError(f"{path}: contains no rays; {remedy}")
    return origins, directions, t_max


def load_triangles(path: Path) -> tuple[Floats, NDArray[np.int32]]:
    """Read all meshes of a model file as one: vertices (n, 3), faces (m, 3)."""
    vertices, faces, first = [], [], 0
    for mesh in read_mesh(path, "flat"):
        vertices.append(mesh.vertices)
        faces.append(mesh.faces + np.int32(first))
        first += len(mesh.vertices)
    return np.concatenate(vertices), np.concatenate(faces)


def scattered_rays(vertices: Floats, count: int = 1 << 20, seed: int = 0) -> Rays:
    """Return random rays through a mesh's bounding box: half of them start inside it."""
    rng = np.random.default_rng(seed)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    inside = rng.uniform(low, high, (count, 3))
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    back = np.where(np.arange(count) % 2, np.linalg.norm(high - low), 0.0)[:, None]
    return (
        (inside - back * directions).astype(np.float32),
        directions.astype(np.float32),
        np.full(count, np.inf, np.float32),
    )


def every(step: int, rays: Rays) -> Rays:
    """Return every step-th ray."""
    origins, directions, t_max = (np.ascontiguousarray(array[::step]) for array in rays)
    return origins, directions, t_max


def differing(expected: NDArray[Any], answers: NDArray[Any]) -> NDArray[np.bool_]:
    """Return which records are not bitwise equal, (n,)."""
    one, other = (np.ascontiguousarray(each).view(np.uint8).reshape(len(answers), -1) for each in (expected, answers))
    return np.asarray((one != other).any(axis=1))


def _others() -> float:
    """Return the processor seconds of this process without this thread's."""
    return time.process_time() - time.thread_time()
