"""Ray casting libraries as called from Python: numpy arrays in and out, including all conversions.

A library is a function from vertices (n, 3) float32 and faces (m, 3) int32 to a function that finds closest hits. The
latter takes origins and directions (k, 3) float32; it returns the first triangles (k,), −1 for a miss, and their t (k,)
if the library reports it. Raises ImportError if the library is not installed.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...queries.mesh import RayQuery
from .ray_speed import Floats
from .workloads import Faces

Answer = tuple[NDArray[Any], Floats | None]
Call = Callable[[Floats, Floats], Answer]


class Library(NamedTuple):
    """A library. prepare: see above; package: its pip name; rays: about as many as it traces in a second."""

    prepare: Callable[[Floats, Faces], Call]
    package: str
    rays: int


def clrt(query: RayQuery) -> Call:
    """Wrap an existing query of clrt."""

    def call(origins: Floats, directions: Floats) -> Answer:
        hits = query.closest_hit(origins, directions)
        return hits["primitive"], hits["t"]

    return call


def embreex(vertices: Floats, faces: Faces) -> Call:
    """Prepare Embree's Python binding; single-threaded."""
    scene = import_module("embreex.rtcore_scene").EmbreeScene()
    import_module("embreex.mesh_construction").TriangleMesh(scene, vertices, faces)

    def call(origins: Floats, directions: Floats) -> Answer:
        hits = scene.run(origins, directions, output=True)
        return hits["primID"], hits["tfar"]

    return call


def trimesh_embreex(vertices: Floats, faces: Faces) -> Call:
    """Prepare trimesh's engine on top of embreex."""
    return _trimesh("trimesh.ray.ray_pyembree", vertices, faces)


def trimesh_rtree(vertices: Floats, faces: Faces) -> Call:
    """Prepare trimesh's own engine, numpy on top of rtree, which it would import at the first ray."""
    import_module("rtree")
    return _trimesh("trimesh.ray.ray_triangle", vertices, faces)


def open3d(vertices: Floats, faces: Faces) -> Call:
    """Prepare Open3D's RaycastingScene, on top of Embree; multithreaded."""
    library = import_module("open3d")
    scene = library.t.geometry.RaycastingScene()
    scene.add_triangles(vertices, faces.astype(np.uint32))

    def call(origins: Floats, directions: Floats) -> Answer:
        hits = scene.cast_rays(library.core.Tensor(np.concatenate([origins, directions], axis=1)))
        return hits["primitive_ids"].numpy().view(np.int32), hits["t_hit"].numpy()

    return call


def warp(vertices: Floats, faces: Faces, device: str = "cpu") -> Call:
    """Prepare NVIDIA's Warp: a kernel over its Mesh; on a CPU it is single-threaded. device: "cpu" or "cuda:0"."""
    library = import_module("warp")
    library.config.log_level = library.LOG_ERROR
    vector = library.vec3

    def closest_hit(mesh: Any, origins: Any, directions: Any, primitives: Any, ts: Any) -> None:
        i = library.tid()
        hit = library.mesh_query_ray(mesh, origins[i], directions[i], library.inf)
        primitives[i] = library.where(hit.result, hit.face, -1)
        ts[i] = library.where(hit.result, hit.t, library.inf)

    vectors = library.array(dtype=vector)
    closest_hit.__annotations__ = {
        "mesh": library.uint64,
        "origins": vectors,
        "directions": vectors,
        "primitives": library.array(dtype=library.int32),
        "ts": library.array(dtype=library.float32),
    }
    kernel = library.kernel(closest_hit)
    mesh = library.Mesh(
        library.array(vertices, dtype=vector, device=device),
        library.array(faces.ravel(), dtype=library.int32, device=device),
    )

    def call(origins: Floats, directions: Floats) -> Answer:
        inputs = [library.array(array, dtype=vector, device=device) for array in (origins, directions)]
        outputs = [library.empty(len(origins), dtype=kind, device=device) for kind in (library.int32, library.float32)]
        library.launch(kernel, len(origins), [mesh.id, *inputs], outputs, device=device)
        primitives, ts = (array.numpy() for array in outputs)
        return primitives, ts

    return call


def _trimesh(engine: str, vertices: Floats, faces: Faces) -> Call:
    mesh = import_module("trimesh").Trimesh(vertices, faces, process=False)
    rays = import_module(engine).RayMeshIntersector(mesh)

    def call(origins: Floats, directions: Floats) -> Answer:
        return rays.intersects_first(origins, directions), None

    return call


LIBRARIES = {
    "embreex": Library(embreex, "embreex", 1 << 20),
    "trimesh + embreex": Library(trimesh_embreex, "embreex", 1 << 20),
    "trimesh + rtree": Library(trimesh_rtree, "rtree", 5),
    "open3d": Library(open3d, "open3d", 1 << 20),
    "warp": Library(warp, "warp-lang", 1 << 20),
}
