"""Primitives compressed with Draco (KHR_draco_mesh_compression), decoded by DracoPy if it is installed."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np

from ...errors import SceneError
from ..decoder import decode
from . import schema as gltf
from .accessors import DTYPES, Array, GltfData


def decompress(data: GltfData, primitive: gltf.Primitive, user: str) -> None:
    """Decode a compressed primitive and store the values of its accessors in `data.decoded`.

    Raises SceneError for damaged data, and if there is neither a decoder nor an uncompressed copy.
    """
    compressed = primitive.extensions.KHR_draco_mesh_compression
    if compressed is None:
        return
    if find_spec("DracoPy") is None:
        position = gltf.entry(data.document.accessors, primitive.attributes["POSITION"], "accessor", user)
        if position.bufferView is not None and position.bufferView != compressed.bufferView:
            return
        raise SceneError(
            f"{user}: is compressed with Draco, whose decoder is not installed; "
            "pip install DracoPy, or export without compression"
        )
    try:
        arrays, _ = decode("draco", data.view(compressed.bufferView, user).tobytes(), ".drc")
    except SceneError as error:
        raise SceneError(f"{user}: its Draco data cannot be decoded: {error}; export it again") from None
    found = {
        primitive.attributes[name]: arrays.get(f"attribute {number}")
        for name, number in compressed.attributes.items()
        if name in primitive.attributes
    }
    if primitive.indices is not None:
        found[primitive.indices] = arrays["faces"].reshape(-1, 1)
    for accessor, values in found.items():
        described = gltf.entry(data.document.accessors, accessor, "accessor", user)
        if values is None or len(values) != described.count:
            count = "none" if values is None else len(values)
            raise SceneError(
                f"{user}: accessor {accessor} has {described.count} elements, but the Draco data {count}; "
                "export it again"
            )
        data.decoded[accessor] = _as_described(values, described)


def _as_described(values: Array, accessor: gltf.Accessor) -> Array:
    """Return decoded integers, which may be 32 bits wide, with the accessor's component type: its largest value is 1 in
    normalized ones."""
    return values.astype(DTYPES[accessor.componentType]) if np.issubdtype(values.dtype, np.integer) else values
