"""glTF nodes that instance a mesh: nodes that share it, and EXT_mesh_gpu_instancing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...scene.geometry.transform import Matrix
from . import schema as gltf
from .accessors import GltfData

#: Maximum number of instances per node; more are taken for a damaged file.
MOST = 2**20
Doubles = NDArray[np.float64]


def matrices(data: GltfData, node: gltf.Node, matrix: Matrix) -> list[Matrix]:
    """Return the matrices at which a node shows its mesh: `matrix`, its own, or that times each of its instances'.

    Raises SceneError for accessors of other types or lengths, and for values that are not finite.
    """
    own = node.extensions.EXT_mesh_gpu_instancing
    if own is None:
        return [matrix]
    name = f'node "{node.name or ""}" (EXT_mesh_gpu_instancing)'
    kinds = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}
    given = {
        key: data.array(own.attributes[key], kind, name).astype(np.float64)
        for key, kind in kinds.items()
        if key in own.attributes
    }
    counts = {len(values) for values in given.values()}
    if len(counts) != 1 or max(counts) > MOST:
        raise SceneError(
            f"{name}: has {' and '.join(map(str, sorted(counts))) or 'no'} transforms; write the same "
            f"number of TRANSLATION, ROTATION and SCALE, at most {MOST}"
        )
    count = counts.pop()
    local = np.tile(np.eye(4), (count, 1, 1))
    local[:, :3, 3] = given.get("TRANSLATION", 0.0)
    local[:, :3, :3] = turns(given["ROTATION"]) if "ROTATION" in given else np.eye(3)
    local[:, :3, :3] *= given.get("SCALE", np.ones((count, 3)))[:, None]
    if not np.isfinite(local).all():
        raise SceneError(
            f"{name}: instance {int(np.argmin(np.isfinite(local).all(axis=(1, 2))))} has a transform that "
            "is not finite; export the file again"
        )
    return list(matrix @ local)


def turns(quaternions: Doubles) -> Doubles:
    """Convert quaternions (k, 4), x, y, z, w, to rotations (k, 3, 3); NaN for quaternions of length zero."""
    with np.errstate(invalid="ignore", divide="ignore"):
        unit = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    v, w, axes = unit[:, None, :3], unit[:, None, 3:], np.eye(3)[None]
    once = np.cross(v, axes)
    return np.asarray((axes + 2 * (w * once + np.cross(v, once))).transpose(0, 2, 1))
