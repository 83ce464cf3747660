"""Writers of small glTF files for the tests."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.formats.gltf.reader import read_gltf
from clrt.scene.model import Model

from ..scene.shapes import icosphere

TYPES = {"<i1": 5120, "<u1": 5121, "<i2": 5122, "<u2": 5123, "<u4": 5125, "<f4": 5126}
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
SHAPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Gltf:
    """glTF document under construction; `document` may be changed freely before writing."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "buffers": [],
            "bufferViews": [],
            "accessors": [],
            "meshes": [],
            "nodes": [],
            "scenes": [{"nodes": []}],
            "scene": 0,
        }

    def view(self, content: bytes, **keys: Any) -> int:
        """Add a buffer view of `content`, on a four-byte boundary."""
        self.data += bytes(-len(self.data) % 4)
        self.document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content), **keys}
        )
        self.data += content
        return len(self.document["bufferViews"]) - 1

    def accessor(self, values: NDArray[Any], dtype: str = "<f4", view: int | None = None, **keys: Any) -> int:
        """Add an accessor of (n, k) or (n,) values, in a new view unless `view` is given."""
        values = np.asarray(values).reshape(len(values), -1)
        if view is None:
            view = self.view(values.astype(dtype).tobytes())
        self.document["accessors"].append(
            {
                "bufferView": view,
                "componentType": TYPES[dtype],
                "count": len(values),
                "type": SHAPES[values.shape[1]],
                **keys,
            }
        )
        return len(self.document["accessors"]) - 1

    def mesh(self, **primitive: Any) -> int:
        """Add a mesh of one primitive and a root node that shows it; return the mesh's index."""
        self.document["meshes"].append({"primitives": [primitive]})
        self.node(mesh=len(self.document["meshes"]) - 1)
        return len(self.document["meshes"]) - 1

    def node(self, root: bool = True, **keys: Any) -> int:
        self.document["nodes"].append(keys)
        index = len(self.document["nodes"]) - 1
        if root:
            self.document["scenes"][0]["nodes"].append(index)
        return index

    def glb(self) -> bytes:
        self.document["buffers"] = [{"byteLength": len(self.data)}]
        text = json.dumps(self.document).encode()
        text += b" " * (-len(text) % 4)
        chunk = bytes(self.data) + bytes(-len(self.data) % 4)
        length = 12 + 8 + len(text) + 8 + len(chunk)
        return (
            struct.pack("<4sII", b"glTF", 2, length)
            + struct.pack("<I4s", len(text), b"JSON")
            + text
            + struct.pack("<I4s", len(chunk), b"BIN\0")
            + chunk
        )

    def write(self, path: Path) -> Path:
        """Write .glb, or .gltf with its bytes in a data URI."""
        if path.suffix == ".glb":
            path.write_bytes(self.glb())
        else:
            uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
            self.write_with_uri(path, uri)
        return path

    def write_with_uri(self, path: Path, uri: str) -> None:
        self.document["buffers"] = [{"byteLength": len(self.data), "uri": uri}]
        path.write_text(json.dumps(self.document))


def ball() -> Gltf:
    """Return an icosahedron: accessor 0 has its positions, accessor 1 its indices."""
    vertices, faces = icosphere(0)
    gltf = Gltf()
    gltf.mesh(attributes={"POSITION": gltf.accessor(vertices)}, indices=gltf.accessor(faces.ravel(), "<u2"))
    return gltf


def read(gltf: Gltf, folder: Path, name: str = "a.glb") -> Model:
    """Write the file and return the model read from it."""
    return read_gltf(gltf.write(folder / name))
