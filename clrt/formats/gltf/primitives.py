"""Primitives of a glTF file: the triangles as stored, and as morph targets and joints move them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...scene.geometry.mesh_faults import index_problems
from ...scene.geometry.normals import Normals, choose_normals
from ...scene.model import Mesh
from . import schema as gltf
from .accessors import GltfData
from .draco import decompress
from .materials import Materials
from .morph_targets import morphed
from .skins import Doubles, Influences, read_influences, skinned

TRIANGLES, STRIP, FAN = 4, 5, 6
#: Attributes that morph targets move, by the mesh's arrays.
MORPHED = {
    "vertices": "POSITION",
    "normals": "NORMAL",
    "tangents": "TANGENT",
    "uv": "TEXCOORD_0",
    "uv1": "TEXCOORD_1",
    "colors": "COLOR_0",
}


@dataclass(frozen=True)
class StoredPrimitive:
    """Triangles in their mesh's frame, before anything moves them. mesh: its normals are the file's, of any length."""

    source: gltf.Primitive
    mesh: Mesh
    user: str
    influences: Influences | None


class Primitives:
    """Primitives of one file; each mesh is read once. normals: see `choose_normals`."""

    def __init__(self, data: GltfData, materials: Materials, normals: Normals) -> None:
        self._data, self._materials, self._normals = data, materials, normals
        self._stored: dict[int, list[StoredPrimitive]] = {}

    def of(self, mesh: int) -> list[StoredPrimitive]:
        """Return a mesh's primitives that have triangles."""
        if mesh not in self._stored:
            self._stored[mesh] = list(_stored(self._data, self._materials, mesh))
        return self._stored[mesh]

    def shaped(self, stored: StoredPrimitive, weights: Sequence[float], joints: Doubles | None = None) -> Mesh:
        """Return a primitive with the weighted morph targets applied: in its mesh's frame or, if moved by the matrices
        of `joints` (k, 3, 4), in the world."""
        mesh = stored.mesh
        moved: dict[str, Any] = {
            name: morphed(self._data, stored.source, key, values, weights, stored.user)
            for name, key in MORPHED.items()
            if (values := getattr(mesh, name)) is not None
        }
        if weights and mesh.colors is not None:
            moved["colors"] = moved["colors"].clip(0, 1)
        mesh = replace(mesh, **moved)
        if joints is not None and stored.influences is not None:
            mesh = skinned(mesh, stored.influences, joints, stored.user)
        usable = self._normals == "file" and mesh.normals is not None
        return replace(
            mesh,
            normals=choose_normals(self._normals, mesh.vertices, mesh.faces, mesh.normals),
            tangents=mesh.tangents if usable else None,
        )


def _stored(data: GltfData, materials: Materials, index: int) -> Iterator[StoredPrimitive]:
    source = gltf.entry(data.document.meshes, index, "mesh", "a node")
    for number, primitive in enumerate(source.primitives):
        name = source.name or f"mesh {index}"
        if len(source.primitives) > 1:
            name += f" part {number}"
        where = f'mesh "{name}"'
        if primitive.mode < TRIANGLES or "POSITION" not in primitive.attributes:
            continue
        decompress(data, primitive, where)
        vertices = np.ascontiguousarray(data.array(primitive.attributes["POSITION"], "VEC3", where), np.float32)
        corners = _corners(data, primitive, len(vertices), where)
        if len(corners) == 0:
            continue
        problems = index_problems(corners, len(vertices), where)
        if problems:
            raise SceneError(problems)
        normal, tangent, uv, uv1 = (
            _attribute(data, primitive, key, kind, len(vertices), where)
            for key, kind in [("NORMAL", "VEC3"), ("TANGENT", "VEC4"), ("TEXCOORD_0", "VEC2"), ("TEXCOORD_1", "VEC2")]
        )
        colors = _colors(data, primitive, len(vertices), where)
        influences = read_influences(data, primitive, len(vertices), where)
        for part in materials.materials(primitive, where, [uv, uv1], corners.astype(np.int32), colors):
            mesh = Mesh(
                vertices,
                part.faces,
                part.material,
                normal,
                name,
                uv=uv,
                uv1=uv1,
                colors=part.colors,
                tangents=tangent,
                material_name=materials.name(primitive),
            )
            yield StoredPrimitive(primitive, mesh, where, influences)


def _attribute(
    data: GltfData, primitive: gltf.Primitive, key: str, kind: str, n: int, user: str
) -> NDArray[np.float32] | None:
    """Return the values (n, k) of an attribute of `n` vertices; those not finite become 0, except in normals."""
    if key not in primitive.attributes:
        return None
    values = np.ascontiguousarray(data.array(primitive.attributes[key], kind, user), np.float32)
    if len(values) != n:
        raise SceneError(f"{user}: has {len(values)} of {key} for {n} vertices; export it again")
    return np.where(np.isfinite(values), values, np.float32(0)) if key != "NORMAL" else values


def _colors(data: GltfData, primitive: gltf.Primitive, n: int, user: str) -> NDArray[np.float32] | None:
    """Return linear vertex colors, with or without alpha."""
    if "COLOR_0" not in primitive.attributes:
        return None
    accessor = gltf.entry(data.document.accessors, primitive.attributes["COLOR_0"], "accessor", user)
    kind = accessor.type if accessor.type == "VEC3" else "VEC4"
    found = _attribute(data, primitive, "COLOR_0", kind, n, user)
    return None if found is None else found.clip(0, 1)


def _corners(data: GltfData, primitive: gltf.Primitive, n: int, user: str) -> NDArray[np.int64]:
    """Return the triangles (m, 3) of a primitive with `n` vertices (specification 3.7.2.1)."""
    if primitive.indices is None:
        order = np.arange(n)
    else:
        indices = data.array(primitive.indices, "SCALAR", user)
        if not np.issubdtype(indices.dtype, np.unsignedinteger):
            raise SceneError(
                f"{user}: its indices, accessor {primitive.indices}, are {indices.dtype}; "
                "they must be unsigned integers"
            )
        order = indices[:, 0].astype(np.int64)
    if primitive.mode == TRIANGLES or primitive.indices in data.decoded:
        if len(order) % 3:
            raise SceneError(f"{user}: has {len(order)} corners, which is not a multiple of 3; export it again")
        return order.reshape(-1, 3)
    first = np.arange(max(len(order) - 2, 0))
    if primitive.mode == FAN:
        corners = np.stack([first + 1, first + 2, np.zeros_like(first)], axis=1)
    else:
        odd = first % 2
        corners = np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)
    return order[corners]
