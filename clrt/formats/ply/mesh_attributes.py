"""A PLY file of faces as one mesh with its own normals and coordinates only, and all other attributes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...errors import SceneError
from ...scene.geometry.mesh_faults import index_problems
from ...scene.model import FloatArray, Mesh
from .attributes import columns_of, coordinates_of
from .elements import Columns, read_elements
from .triangles import Triangles, faces_of

Attributes = Mapping[str, FloatArray]


def mesh_with_attributes(path: Path, content: bytes | None = None) -> tuple[Mesh, Attributes] | None:
    """Read a PLY file of faces with all its attributes; None for others. content: of the file, if it was read."""
    try:
        _, elements = read_elements(path.read_bytes() if content is None else content, ("vertex", "face"))
    except SceneError as error:
        raise SceneError([f"{path}: {problem}" for problem in error.problems]) from None
    vertex, found = elements.get("vertex"), faces_of(elements)
    points = None if vertex is None else columns_of(vertex, ("x", "y", "z"))
    if vertex is None or found is None or points is None:
        return None
    face, triangles = found[0], Triangles(found[1], points)
    if problems := index_problems(triangles.vertices, vertex.number, f'mesh "{path.stem}"'):
        raise SceneError([f"{path}: {problem}" for problem in problems])
    mesh = Mesh(points, triangles.vertices, name=path.stem)
    normals, uv = columns_of(vertex, ("nx", "ny", "nz")), coordinates_of(vertex)
    mesh.normals = None if normals is None else normals.astype(np.float32)
    mesh.uv = None if uv is None else uv.astype(np.float32)
    of_faces = {name: values[triangles.polygons] for name, values in _attributes(face).items()}
    attributes = {f"vertex_{name}": values for name, values in _attributes(vertex).items()}
    return mesh, attributes | {f"face_{name}": values for name, values in of_faces.items()}


def _attributes(table: Columns) -> dict[str, FloatArray]:
    """Collect columns color_0, color_1 … into arrays (n, k), by name."""
    groups: dict[str, list[str]] = {}
    for column in table.scalars:
        name, _, place = column.rpartition("_")
        if name and place.isdigit() or name and place in "rgb":
            groups.setdefault(name, []).append(column)
    return {
        name: np.column_stack([table.scalars[column] for column in columns]).astype(np.float32)
        for name, columns in groups.items()
    }
