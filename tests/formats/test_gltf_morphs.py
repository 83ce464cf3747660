"""Morph targets of glTF files, applied with the weights in the file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.errors import SceneError

from .glb import TRIANGLE, Gltf, read

RNG = np.random.default_rng(31)
#: Displacements of two targets.
MOVES = RNG.normal(size=(2, 3, 3)).astype(np.float32)


def morphed(weights: list[float] | None, node_weights: list[float] | None = None) -> Gltf:
    """Return a triangle with normals along +Z and two targets; the second one has no normals."""
    gltf = Gltf()
    normals = np.tile(np.array([0, 0, 1], np.float32), (3, 1))
    first, second = ({"POSITION": gltf.accessor(moves)} for moves in MOVES)
    gltf.mesh(
        attributes={"POSITION": gltf.accessor(TRIANGLE), "NORMAL": gltf.accessor(normals)},
        targets=[first | {"NORMAL": gltf.accessor(MOVES[0])}, second],
    )
    if weights is not None:
        gltf.document["meshes"][0]["weights"] = weights
    if node_weights is not None:
        gltf.node(mesh=0, weights=node_weights)
    return gltf


def expected(weights: list[float]) -> NDArray[np.float64]:
    return TRIANGLE + np.tensordot(weights, MOVES.astype(np.float64), 1)


@pytest.mark.parametrize("weights", [None, [0.0, 0.0], [1.0, 0.0], [0.25, -1.5]])
def test_positions_and_normals(tmp_path: Path, weights: list[float] | None) -> None:
    """Vertices and normals are displaced by each target times its weight, 0 if the file has none."""
    (mesh,) = read(morphed(weights), tmp_path).meshes
    weights = weights or [0.0, 0.0]
    assert mesh.vertices == pytest.approx(expected(weights), abs=1e-6) and mesh.normals is not None
    bent = np.array([0, 0, 1]) + weights[0] * MOVES[0]
    assert mesh.normals == pytest.approx(bent / np.linalg.norm(bent, axis=1, keepdims=True), abs=1e-5)


def test_nodes_have_weights_of_their_own(tmp_path: Path) -> None:
    """They replace the mesh's; another node of the mesh keeps those."""
    one, other = read(morphed([0.5, 0.5], [0.0, 2.0]), tmp_path).meshes
    assert one.vertices == pytest.approx(expected([0.5, 0.5]), abs=1e-6)
    assert other.vertices == pytest.approx(expected([0.0, 2.0]), abs=1e-6)


def test_texture_coordinates_colors_and_tangents(tmp_path: Path) -> None:
    """A tangent's sign stays; colors are limited to 1."""
    gltf = Gltf()
    corners = RNG.uniform(0, 1, (3, 4)).astype(np.float32)
    tangents = np.tile(np.array([1, 0, 0, -1], np.float32), (3, 1))
    stored = {"TANGENT": tangents, "TEXCOORD_0": corners[:, :2], "TEXCOORD_1": corners[:, 2:], "COLOR_0": corners}
    moves = {key: RNG.uniform(0, 1, (3, 3 if key == "TANGENT" else values.shape[1])) for key, values in stored.items()}
    normals = np.tile(np.array([0, 0, 1], np.float32), (3, 1))
    gltf.mesh(
        attributes={"POSITION": gltf.accessor(TRIANGLE), "NORMAL": gltf.accessor(normals)}
        | {key: gltf.accessor(values) for key, values in stored.items()},
        targets=[{key: gltf.accessor(values) for key, values in moves.items()}],
    )
    gltf.document["materials"] = [{"alphaMode": "BLEND"}]
    gltf.document["meshes"][0]["primitives"][0]["material"] = 0
    gltf.document["meshes"][0]["weights"] = [0.5]
    (mesh,) = read(gltf, tmp_path).meshes
    for name, key in [("uv", "TEXCOORD_0"), ("uv1", "TEXCOORD_1"), ("colors", "COLOR_0")]:
        moved = stored[key] + 0.5 * moves[key]
        np.testing.assert_allclose(getattr(mesh, name), moved.clip(0, 1) if name == "colors" else moved, atol=1e-6)
    assert mesh.tangents is not None
    np.testing.assert_allclose(mesh.tangents[:, :3], tangents[:, :3] + 0.5 * moves["TANGENT"], atol=1e-6)
    assert (mesh.tangents[:, 3] == -1).all()


def test_sparse_displacements(tmp_path: Path) -> None:
    """A target that moves one vertex, without a base; its integers are normalised."""
    gltf = morphed([0.5, 0.0])
    sparse = {
        "count": 1,
        "indices": {"bufferView": gltf.view(bytes([1])), "componentType": 5121},
        "values": {"bufferView": gltf.view(np.array([32767, 0, -32767], "<i2").tobytes())},
    }
    target = {"componentType": 5122, "normalized": True, "count": 3, "type": "VEC3", "sparse": sparse}
    gltf.document["accessors"].append(target)
    gltf.document["meshes"][0]["primitives"][0]["targets"][0]["POSITION"] = len(gltf.document["accessors"]) - 1
    (mesh,) = read(gltf, tmp_path).meshes
    np.testing.assert_array_equal(mesh.vertices, TRIANGLE + [[0, 0, 0], [0.5, 0, -0.5], [0, 0, 0]])


def test_faults_are_named(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="has 2 morph targets, but 3 weights"):
        read(morphed([1.0, 1.0, 1.0]), tmp_path)
    gltf = morphed([1.0, 1.0])
    gltf.document["meshes"][0]["primitives"][0]["targets"][1]["POSITION"] = gltf.accessor(MOVES[0][:2])
    with pytest.raises(SceneError, match="a morph target has 2 of POSITION for 3 vertices"):
        read(gltf, tmp_path)
