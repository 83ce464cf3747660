"""Writing of one mesh as a binary glTF file, with all arrays unchanged, since a scene file cannot hold a mesh itself.

Format: Khronos Group, glTF 2.0 specification, 2021.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np

from ...scene.model import Mesh

_FLOAT, _UINT = 5126, 5125
_ATTRIBUTES = {
    "vertices": "POSITION",
    "normals": "NORMAL",
    "uv": "TEXCOORD_0",
    "uv1": "TEXCOORD_1",
    "colors": "COLOR_0",
    "tangents": "TANGENT",
}
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


def mesh_glb(mesh: Mesh) -> bytes:
    """Return the content of the .glb file. Of the mesh's material only the alpha mode is written."""
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    binary = b""

    def add(array: Any, kind: int, **more: Any) -> int:
        nonlocal binary
        data = np.ascontiguousarray(array).tobytes()
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": kind,
                "count": len(array),
                "type": _TYPES[1 if array.ndim == 1 else array.shape[1]],
                **more,
            }
        )
        binary += data
        return len(accessors) - 1

    bounds = {"min": mesh.vertices.min(axis=0).tolist(), "max": mesh.vertices.max(axis=0).tolist()}
    arrays = {name: array for name in _ATTRIBUTES if (array := getattr(mesh, name)) is not None}
    attributes = {
        _ATTRIBUTES[name]: add(array.astype("<f4"), _FLOAT, **(bounds if name == "vertices" else {}))
        for name, array in arrays.items()
    }
    primitive = {"attributes": attributes, "indices": add(mesh.faces.astype("<u4").ravel(), _UINT)}
    if mesh.has_alpha:
        primitive["material"] = 0
    document = {
        "asset": {"version": "2.0", "generator": "clrt"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": mesh.name}],
        "meshes": [{"name": mesh.name, "primitives": [primitive]}],
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": views,
        "accessors": accessors,
        **({"materials": [{"alphaMode": "BLEND"}]} if mesh.has_alpha else {}),
    }
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks
