"""Morph targets of a glTF primitive, applied with given weights (specification 3.7.2.2)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from . import schema as gltf
from .accessors import GltfData

Floats = NDArray[np.float32]
VECTORS = {2: "VEC2", 3: "VEC3", 4: "VEC4"}


def weights_of(node: gltf.Node, mesh: gltf.Mesh) -> tuple[float, ...]:
    """Return the node's weights, else the mesh's; empty if all are zero."""
    weights = node.weights or mesh.weights
    return tuple(weights) if any(weights) else ()


def morphed(
    data: GltfData, primitive: gltf.Primitive, key: str, values: Floats, weights: Sequence[float], user: str
) -> Floats:
    """Return an attribute's values (n, k) with the targets' weighted displacements added, in TANGENT without the sign.

    Raises SceneError if the numbers of weights and targets, or of displacements and values, differ.
    """
    if not weights:
        return values
    if len(weights) != len(primitive.targets):
        raise SceneError(
            f"{user}: has {len(primitive.targets)} morph targets, but {len(weights)} weights; export it again"
        )
    size = 3 if key == "TANGENT" else values.shape[1]
    moved = values.astype(np.float64)
    for weight, target in zip(weights, primitive.targets):
        if weight and key in target:
            kind = VECTORS[size]
            if key == "COLOR_0":  # the alpha of either may be missing
                found = gltf.entry(data.document.accessors, target[key], "accessor", user).type
                kind = "VEC3" if found == "VEC3" else "VEC4"
            moves = data.array(target[key], kind, f"{user}, morph target")[:, :size]
            if len(moves) != len(values):
                raise SceneError(
                    f"{user}: a morph target has {len(moves)} of {key} for {len(values)} vertices; export it again"
                )
            moved[:, : moves.shape[1]] += weight * np.where(np.isfinite(moves), moves, 0)
    return moved.astype(np.float32)
