"""Reader for 3MF (3D Manufacturing Format): the meshes of the build with their materials, colors and textures.

Specifications: 3MF core 1.3, materials and properties 1.2. Beams, slices, volumes and supports are ignored with a
warning.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...file_names import printable
from ...scene.editing import free_name
from ...scene.geometry.mesh_faults import index_problems
from ..archives import check_archive
from ..decoder import decode
from ..seams import with_corner_attributes
from ..used_indices import used_indices
from .properties import Appearance, Properties

log = logging.getLogger(__name__)
Array = NDArray[Any]


def parse_3mf(path: Path) -> dict[str, Any]:
    """Read meshes by name, a mesh for each material, with trimesh's names of arrays (see `models.of_parts`), and where
    the build places them. Raises SceneError for malformed files."""
    if find_spec("lib3mf") is None:
        raise SceneError("is read by lib3mf, which is not installed; pip install lib3mf, or export another format")
    check_archive(path, compressed=True)
    try:
        arrays, facts = decode("3mf", path)
    except SceneError as error:
        raise SceneError(f"cannot be read as 3MF: {printable(str(error))}; export it again") from None
    properties = Properties(path, arrays, facts)
    pieces, numbers = dict[str, dict[str, Any]](), dict[str, int]()
    names: dict[int, list[str]] = {}
    for number in np.unique(arrays["numbers"]).tolist():
        mesh = facts["meshes"][number]
        name = printable(mesh["name"]) or f"object {mesh['id']}"
        names[number] = []
        for piece in _pieces(name, arrays, number, properties):
            own = free_name(name, pieces, numbers)
            names[number].append(own)
            pieces[own] = piece
    ignored = [f"{what} ({count})" for what, count in facts["ignored"].items()] + properties.ignored
    if ignored:
        log.warning("%s: ignored: %s", path, ", ".join(ignored))
    matrices = np.diag([facts["factor"]] * 3 + [1.0]) @ arrays["matrices"]
    return {
        "geometry": pieces,
        "places": [
            (name, matrix) for number, matrix in zip(arrays["numbers"], matrices) for name in names[int(number)]
        ],
        "up": "z",
        "unit": facts["unit"],
    }


def _pieces(name: str, arrays: dict[str, Array], number: int, properties: Properties) -> Iterator[dict[str, Any]]:
    """Yield the parts of a mesh that differ in appearance."""
    vertices, triangles = arrays[f"vertices {number}"], arrays[f"triangles {number}"]
    if problems := index_problems(triangles, len(vertices), f'object "{name}"'):
        raise SceneError(problems)
    for rows, appearance in properties.appearances(arrays[f"properties {number}"]):
        yield _piece(vertices, triangles[rows], appearance)


def _piece(vertices: Array, faces: Array, appearance: Appearance) -> dict[str, Any]:
    used, corners = used_indices(faces.ravel())
    whole = {"vertices": vertices[used], "faces": corners.reshape(-1, 3)}
    corner = {"vertex_colors": appearance.colors, "uv": appearance.uv}
    split = with_corner_attributes(whole, {key: values for key, values in corner.items() if values is not None})
    return {**split, "material": appearance.material, "material_name": appearance.name}
