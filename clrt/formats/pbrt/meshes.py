"""pbrt's meshes: triangles, bilinear patches, subdivision surfaces and PLY files, in the shape's own coordinates."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ...errors import SceneError
from ...scene.geometry.normals import smooth_normals
from ...scene.model import FloatArray, Mesh
from ..archives import gunzipped
from ..ply.mesh_attributes import mesh_with_attributes
from ..referenced_files import check_file
from ..scene_parts.grids import grid, quads
from .entities import Entity
from .loop_subdivision import subdivided
from .tokens import Doubles

#: Segments of each side of a patch that is not a parallelogram, and the tolerance for one that is.
SEGMENTS, FLAT = 16, 1e-6
#: Maximum number of triangles that subdivision and patches may make.
MOST_FACES = 1 << 23
#: Texture coordinates of the corners of triangles without any.
CORNERS = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0))


def triangles(entity: Entity) -> Mesh:
    """Return a trianglemesh."""
    entity.ignore(("S", "faceIndices"))
    points = _points(entity)
    default = np.array([(0.0, 1, 2)]) if len(points) == 3 else None
    mesh = Mesh(points.astype(np.float32), entity.indices("indices", len(points), 3, default).astype(np.int32))
    mesh.normals, mesh.uv = _per_vertex(entity, "N", 3, len(points)), _coordinates(entity, len(points))
    return mesh


def subdivision(entity: Entity) -> Mesh:
    """Return a loopsubdiv, with smooth normals."""
    entity.ignore(["scheme"])
    points = _points(entity)
    faces = entity.indices("indices", len(points), 3, None).astype(np.int64)
    levels = entity.integer("levels" if "levels" in entity.parameters else "nlevels", 3)
    if not 0 <= levels <= 16 or len(faces) * 4**levels > MOST_FACES:
        raise entity.fault("levels", f"is {levels}", f"write one that gives at most {MOST_FACES} triangles")
    vertices, finer = subdivided(points, faces, levels)
    mesh = Mesh(vertices.astype(np.float32), np.ascontiguousarray(finer, np.int32))
    mesh.normals = smooth_normals(mesh.vertices, mesh.faces)
    return mesh


def patches(entity: Entity) -> Mesh:
    """Return a bilinearmesh: two triangles for parallelograms, and finer ones for other patches."""
    entity.ignore(("faceIndices", "emissionfilename"))
    points = _points(entity)
    default = np.array([(0.0, 1, 2, 3)]) if len(points) == 4 else None
    corners = entity.indices("indices", len(points), 4, default).astype(np.int64)
    found = points[corners]  # at (0, 0), (1, 0), (0, 1), (1, 1)
    bent = np.abs(found[:, 0] + found[:, 3] - found[:, 1] - found[:, 2]).max()
    normals, uv = _per_vertex(entity, "N", 3, len(points)), _coordinates(entity, len(points))
    count = SEGMENTS if bent > FLAT * np.ptp(found.reshape(-1, 3), axis=0).max() or normals is not None else 1
    if 2 * count * count * len(corners) > MOST_FACES:
        raise entity.fault("indices", f"makes more than {MOST_FACES} triangles", "write a trianglemesh")
    u, v = grid(count, count)
    weights = np.stack([(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v], axis=1)
    own = np.array([(0.0, 0), (1, 0), (0, 1), (1, 1)])
    faces = quads(count, count) + len(u) * np.arange(len(corners))[:, None, None]
    return Mesh(
        (weights @ found).reshape(-1, 3).astype(np.float32),
        np.ascontiguousarray(faces.reshape(-1, 3), np.int32),
        uv=(weights @ (np.tile(own, (len(corners), 1, 1)) if uv is None else uv[corners]))
        .reshape(-1, 2)
        .astype(np.float32),
        normals=None if normals is None else (weights @ normals[corners]).reshape(-1, 3).astype(np.float32),
    )


def ply(entity: Entity) -> Mesh:
    """Return the mesh of a PLY file."""
    path = Path(entity.path("filename"))
    check_file(path, "model")
    content = gunzipped(path) if path.suffix.lower() == ".gz" else path.read_bytes()
    found = mesh_with_attributes(path, content)
    if found is None:
        raise SceneError(f"{path}: has no faces; export triangles")
    return replace(found[0], colors=None, tangents=None)


def with_coordinates(mesh: Mesh) -> Mesh:
    """Return a mesh with pbrt's default coordinates, in which each triangle shows half the texture."""
    if mesh.uv is not None:
        return mesh
    corners = mesh.faces.ravel()
    return replace(
        mesh,
        vertices=mesh.vertices[corners],
        faces=np.arange(len(corners), dtype=np.int32).reshape(-1, 3),
        normals=None if mesh.normals is None else mesh.normals[corners],
        uv=np.tile(np.array(CORNERS, np.float32), (len(mesh.faces), 1)),
    )


def facing(mesh: Mesh) -> Mesh:
    """Return the mesh with its faces wound so that their fronts are where its normals point."""
    if mesh.normals is None:
        return mesh
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    turned = np.einsum("ij,ij->i", cross, mesh.normals[mesh.faces].sum(axis=1, dtype=np.float64)) < 0
    faces = np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces)
    return replace(mesh, faces=np.ascontiguousarray(faces))


def _points(entity: Entity) -> Doubles:
    points = entity.rows("P", 3, "point3", "vector3")
    if points is None or not len(points):
        raise entity.fault("P", "is missing", "add the vertices")
    return points


def _coordinates(entity: Entity, count: int) -> FloatArray | None:
    """Return texture coordinates, which v3 calls uv or st."""
    names = [name for name in ("uv", "st") if name in entity.parameters]
    return _per_vertex(entity, names[0] if names else "uv", 2, count)


def _per_vertex(entity: Entity, name: str, width: int, count: int) -> FloatArray | None:
    """Return values (count, width) as float32; None if there are none, or as in pbrt if their number is another."""
    rows = entity.rows(name, width, "normal" if width == 3 else "point2", "float", "vector2", "vector3", "point3")
    return None if rows is None or len(rows) != count else np.asarray(rows, np.float32)
