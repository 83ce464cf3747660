"""G11: instances with difficult transforms are hit like triangles transformed in float64, without shadow acne."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ....queries.instanced import InstancedRayQuery
from ....scene.geometry.transform import transform_mesh
from ....scene.model import Instance, Mesh, Scene
from ...rays.ray_speed import scattered_rays
from ...rays.workloads import Doubles, bumpy_ball, subdivide
from ..exact_hits import closest_bounds
from ..row import Row
from .departures import lit_scenes, wrong_pixels
from .subject import Subject

INSTANCES = 12
#: A plane of 4^8 triangles, used three times, is large enough to be kept as instances (scene/geometry/instancing.py).
SUBDIVISIONS, LOWER = 8, 50.0


def measure_instances(subject: Subject, *, quick: bool) -> Iterator[Row]:
    """Count the hits that float64 rules out, for each kind of transform."""
    count = 1 << (10 if quick else 14)
    vertices, faces = bumpy_ball(1)
    for kind, transforms in transforms_of_kinds().items():
        query = InstancedRayQuery(
            [(vertices, faces)],
            np.zeros(len(transforms), np.int32),
            transforms,
            device=subject.device,
            layout=subject.layout,
            triangle=subject.triangle,
        )
        baked = transforms[:, None, :, 3] + np.einsum("kij,nj->kni", transforms[..., :3], vertices.astype(np.float64))
        first = len(vertices) * np.arange(len(transforms))[:, None, None]
        world = baked.reshape(-1, 3), (faces + first).reshape(-1, 3)
        rays = scattered_rays(world[0].astype(np.float32), count)
        hits = query.closest_hit(*rays)
        hits["primitive"] += np.where(hits["primitive"] >= 0, len(faces) * hits["instance"], 0)
        wrong = closest_bounds(*world, rays).wrong(rays, hits)
        yield Row("G11", f"{INSTANCES} instances, {kind}", count, int(np.count_nonzero(wrong)))
    for kind, transforms in transforms_of_kinds().items():
        yield Row("G11", f"lit plane, {kind}: dark", *wrong_pixels(subject, lit_plane(transforms[0]), quick, lit=False))


def lit_plane(to_world: Doubles) -> Scene:
    """Return a tilted plane instanced with this transform that fills the image, with an unoccluded light. Two more
    instances lie below."""
    scene = lit_scenes(to_world[:, 3], 1.0, level_only=False)["tilted plane"]
    plane, matrix = scene.meshes[0], np.vstack([to_world, [0, 0, 0, 1]])
    vertices, faces = plane.vertices, plane.faces
    for _ in range(SUBDIVISIONS):
        vertices, faces = subdivide(vertices, faces)
    mesh = transform_mesh(Mesh(vertices, faces, plane.material), np.linalg.inv(matrix))
    instances = [
        Instance(mesh, np.column_stack([to_world[:, :3], to_world[:, 3] - depth * np.cross(*_edges(plane))]))
        for depth in (0.0, LOWER, 2 * LOWER)
    ]
    return replace(scene, meshes=[], instances=instances)


def _edges(plane: Mesh) -> Doubles:
    """Return two unit vectors in a plane, (2, 3), whose cross product is its normal."""
    corners = plane.vertices[plane.faces[0]].astype(np.float64)
    first, second = corners[1] - corners[0], corners[2] - corners[0]
    side = np.cross(np.cross(first, second), first)
    return np.array([first / np.linalg.norm(first), side / np.linalg.norm(side)])


def transforms_of_kinds() -> dict[str, Doubles]:
    """Return transforms (INSTANCES, 3, 4) by kind, rounded to float32."""
    rng = np.random.default_rng(0)
    turns = np.linalg.qr(rng.normal(size=(INSTANCES, 3, 3)))[0]
    moves = rng.uniform(-8, 8, (INSTANCES, 3, 1))
    stretch = 10 ** rng.uniform(-1, 1, (INSTANCES, 1, 3))
    flat = np.where(np.arange(3) == 1, 1e-3, 1.0)
    kinds = {
        "turned": turns,
        "stretched": turns * stretch,
        "mirrored": turns * [-1, 1, 1],
        "nearly flat": turns * flat,
        "sheared": turns @ (stretch * turns[::-1]),
        "far away": turns,
    }
    far = {"far away": 1e4 + moves}
    return {
        kind: np.concatenate([linear, far.get(kind, moves)], axis=2).astype(np.float32).astype(np.float64)
        for kind, linear in kinds.items()
    }
