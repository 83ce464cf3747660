"""Draco's meshes, decoded by DracoPy in the decoder process."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def decode(file: str) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Decode a Draco mesh: faces (m, 3) uint32, and each attribute (n, k) as "attribute ID"."""
    import DracoPy

    with open(file, "rb") as content:
        mesh = DracoPy.decode(content.read())
    faces = np.asarray(mesh.faces, np.uint32).reshape(-1, 3)
    return {
        "faces": faces,
        **{f"attribute {attribute['unique_id']}": np.asarray(attribute["data"]) for attribute in mesh.attributes},
    }, {}
