"""Meshes of a PLY file; one of points alone becomes small spheres."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import SceneError
from ...file_names import printable
from ...scene.geometry.mesh_faults import index_problems
from ...scene.materials.material_types import Diffuse
from ...scene.materials.textures import Picture, Texture
from ..images.image_reader import read_texels
from ..referenced_files import find_file, name_of
from ..seams import with_corner_attributes
from ..used_indices import used_indices
from .attributes import Array, colors_of, columns_of, coordinates_of, corner_coordinates
from .elements import Columns, Lists, read_elements
from .points import point_spheres
from .triangles import Triangles, faces_of, strip_triangles

log = logging.getLogger(__name__)


def parse_ply(path: Path) -> dict[str, Any]:
    """Read a PLY file. Return trimesh's names of arrays: vertices (n, 3), faces (m, 3), vertex_normals (n, 3) or None,
    uv (n, 2) or None with v up, vertex_colors (n, 3 or 4) or None, from 0 to 1; and a texture's `material` and
    `material_name`. With faces these are in `geometry`, for each texture.

    Raises SceneError for malformed files and for indices out of range.
    """
    header, elements = read_elements(path.read_bytes(), ("vertex", "face", "tristrips"))
    vertex = elements.get("vertex")
    points = None if vertex is None else columns_of(vertex, ("x", "y", "z"))
    if vertex is None or points is None:
        raise SceneError("its vertices have no x, y and z; export the model again")
    # Coordinates of a reference system, as surveys name one in a comment, have the height as the last.
    up = "z" if any(comment.lower().startswith("crs ") for comment in header.comments) else "y"
    if sum(columns.number for columns in elements.values()) == vertex.number:
        return point_spheres(path, points, vertex.scalars.get("radius"), colors_of(vertex)) | {"up": up}
    found = faces_of(elements)
    triangles = None if found is None else Triangles(found[1], points)
    faces = strip_triangles(elements) if triangles is None else triangles.vertices
    if problems := index_problems(faces, vertex.number, f'mesh "{name_of(path)}"'):
        raise SceneError(problems)
    whole = {
        "vertices": _finite_where_unused(points, faces),
        "faces": faces,
        "vertex_normals": columns_of(vertex, ("nx", "ny", "nz")),
        "uv": coordinates_of(vertex),
        "vertex_colors": colors_of(vertex),
    }
    textures = np.zeros(len(faces), np.int64)
    if found is not None and triangles is not None:
        triangles.warn_of_ignored(path)
        whole = with_corner_attributes(whole, _of_corners(*found, triangles, whole["vertex_colors"] is None))
        if "texnumber" in found[0].scalars:
            textures = found[0].scalars["texnumber"].astype(np.int64)[triangles.polygons]
    return {"geometry": _by_texture(path, header.comments, whole, textures), "up": up}


def _finite_where_unused(points: Array, faces: Array) -> Array:
    """Return the points with those that no face uses moved to one that is used if they are not finite, as scanners mark
    missing points."""
    if np.isfinite(points).all() or not len(faces):
        return points
    bad = np.asarray(~np.isfinite(points).all(axis=1))
    bad[faces] = False
    points[bad] = points[faces[0, 0]]
    return points


def _of_corners(face: Columns, polygons: Lists, triangles: Triangles, with_colors: bool) -> dict[str, Array]:
    """Return the texture coordinates and colors that faces have, by corner of the triangles."""
    of_corners: dict[str, Array] = {}
    if (uv := corner_coordinates(face, polygons)) is not None:
        of_corners["uv"] = uv[triangles.corners.ravel()]
    if with_colors and (colors := colors_of(face)) is not None:
        of_corners["vertex_colors"] = np.repeat(colors[triangles.polygons], 3, axis=0)
    return of_corners


def _by_texture(path: Path, comments: Sequence[str], whole: dict[str, Any], numbers: Array) -> dict[str, Any]:
    """Return the mesh as one part for each texture, with its material, by name. numbers: of the faces' textures."""
    name, key = name_of(path), "TextureFile"
    files = [comment[len(key) :].strip() for comment in comments if comment.startswith(key)]
    if len(files) < 2:
        return {name: {**whole, **_textured(path, *files)}}
    return {
        f"{name} {number}": {**_part(whole, numbers == number), **_textured(path, *files[number : number + 1])}
        for number in np.unique(numbers.clip(0, len(files))).tolist()
    }


def _part(whole: dict[str, Any], chosen: Array) -> dict[str, Any]:
    """Return the chosen faces and the vertices that they use."""
    used, faces = used_indices(whole["faces"][chosen].ravel())
    arrays = {name: None if values is None else values[used] for name, values in whole.items() if name != "faces"}
    return {**arrays, "faces": faces.reshape(-1, 3)}


def _textured(path: Path, name: str = "") -> dict[str, Any]:
    """Return the material of a texture next to the model: nothing without one, or with a warning if it cannot be
    read."""
    if not name:
        return {}
    try:
        file = find_file(path, [path.parent], name) or path.parent / name
        texture = Texture(picture=Picture(read_texels(file), printable(name)))
    except (SceneError, OSError, ValueError) as error:
        log.warning("%s: a texture is ignored: %s", path, error)
        return {}
    return {"material": Diffuse(color=texture), "material_name": printable(name)}
