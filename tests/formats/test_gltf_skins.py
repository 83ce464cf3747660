"""Skins of glTF files at their rest pose, against the specification's formulas in float64."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from clrt.errors import SceneError

from ..scene.shapes import icosphere
from .glb import Gltf, read

VERTICES, FACES = icosphere(1)
POINTS = VERTICES.astype(np.float64)
COUNT, JOINTS = len(VERTICES), 3
Doubles = NDArray[np.float64]


class Skinned:
    """A sphere on an arm of three joints, whose node is scaled; `worlds`, `inverse`: (3, 4, 4) matrices of the joints,
    and those to their rest poses."""

    def __init__(self, sets: int = 1, weight: str = "<f4", inverse: bool = True, seed: int = 1) -> None:
        rng = np.random.default_rng(seed)
        self.gltf = gltf = Gltf()
        self.joints = rng.integers(0, JOINTS, (COUNT, 4 * sets))
        shares = rng.uniform(0.1, 1, (COUNT, 4 * sets))
        shares /= shares.sum(axis=1, keepdims=True)
        most = 1 if weight == "<f4" else np.iinfo(weight).max
        self.weights = (shares * most if most == 1 else np.round(shares * most)) / most
        attributes = {"POSITION": gltf.accessor(VERTICES), "NORMAL": gltf.accessor(VERTICES)}
        for number in range(sets):
            part = slice(4 * number, 4 * number + 4)
            attributes[f"JOINTS_{number}"] = gltf.accessor(self.joints[:, part], "<u1" if number else "<u2")
            attributes[f"WEIGHTS_{number}"] = gltf.accessor(
                self.weights[:, part] * most, weight, **({"normalized": True} if most > 1 else {})
            )
        gltf.mesh(attributes=attributes, indices=gltf.accessor(FACES.ravel(), "<u2"))
        self.primitive = gltf.document["meshes"][0]["primitives"][0]
        self.node: dict[str, Any] = gltf.document["nodes"][0]
        self.node |= {"skin": 0, "scale": [100, 100, 100], "translation": [7, 8, 9]}
        local = [self._joint(rng) for _ in range(JOINTS)]
        self.worlds = np.array([np.linalg.multi_dot([np.eye(4), np.eye(4), *local[: k + 1]]) for k in range(JOINTS)])
        numbers = [len(gltf.document["nodes"]) + k for k in range(JOINTS)]
        for k in range(JOINTS):
            children = {"children": [numbers[k + 1]]} if k + 1 < JOINTS else {}
            gltf.node(root=k == 0, matrix=local[k].T.ravel().tolist(), **children)
        self.skin: dict[str, Any] = {"joints": numbers}
        gltf.document["skins"] = [self.skin]
        self.inverse = np.tile(np.eye(4), (JOINTS, 1, 1))
        if inverse:
            self.inverse[:, :3] = rng.normal(size=(JOINTS, 3, 4))
            self.inverse = self.inverse.astype(np.float32).astype(np.float64)
            columns = self.inverse.transpose(0, 2, 1).reshape(-1, 16)
            self.skin["inverseBindMatrices"] = gltf.accessor(columns)

    @staticmethod
    def _joint(rng: np.random.Generator) -> Doubles:
        matrix = np.eye(4)
        matrix[:3, :3] = Rotation.random(random_state=rng.integers(100)).as_matrix() * rng.uniform(0.5, 2)
        matrix[:3, 3] = rng.normal(size=3)
        return matrix

    def expected(self, vertices: Doubles, normals: Doubles) -> tuple[Doubles, Doubles]:
        """Return vertices and normals as the specification has them: one by one, with weights of sum 1."""
        moved, turned = np.empty((COUNT, 3)), np.empty((COUNT, 3))
        for n in range(COUNT):
            total = self.weights[n].sum()
            matrix = sum(
                weight / total * self.worlds[joint] @ self.inverse[joint]
                for joint, weight in zip(self.joints[n], self.weights[n])
            )
            moved[n] = (matrix @ [*vertices[n], 1])[:3]
            normal = np.linalg.inv(matrix[:3, :3]).T @ normals[n]
            turned[n] = normal / np.linalg.norm(normal)
        return moved, turned


def check(skinned: Skinned, tmp_path: Path, vertices: Doubles = POINTS, normals: Doubles = POINTS) -> None:
    (mesh,) = read(skinned.gltf, tmp_path).meshes
    moved, turned = skinned.expected(vertices, normals)
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.vertices, moved, atol=3e-6 * np.abs(moved).max())
    np.testing.assert_allclose(mesh.normals, turned, atol=1e-4)


@pytest.mark.parametrize("inverse", [True, False])
@pytest.mark.parametrize("sets", [1, 2, 3])
@pytest.mark.parametrize("weight", ["<f4", "<u1", "<u2"])
def test_vertices_follow_their_joints(sets: int, weight: str, inverse: bool, tmp_path: Path) -> None:
    """Sets of four to twelve influences, in each type of weights; the node's own transform does not count."""
    check(Skinned(sets, weight, inverse, seed=4 * sets), tmp_path)


def test_weights_are_divided_by_their_sum(tmp_path: Path) -> None:
    """A vertex without weights follows its first joint; negative weights and those that are not finite count as 0."""
    skinned = Skinned()
    stored = (skinned.weights * 1.5).astype(np.float32)
    stored[0], stored[1], stored[2] = 0, (np.nan, 0.5, 0, 0), (-1, 0.25, 0.25, np.inf)
    skinned.primitive["attributes"]["WEIGHTS_0"] = skinned.gltf.accessor(stored)
    skinned.weights[:3] = (1, 0, 0, 0), (0, 1, 0, 0), (0, 0.5, 0.5, 0)
    skinned.joints[0] = 2, 0, 1, 0
    skinned.primitive["attributes"]["JOINTS_0"] = skinned.gltf.accessor(skinned.joints, "<u1")
    check(skinned, tmp_path)


def test_morph_targets_move_before_joints(tmp_path: Path) -> None:
    skinned = Skinned(2)
    moves = np.random.default_rng(8).normal(size=(2, COUNT, 3)).astype(np.float32)
    skinned.primitive["targets"] = [
        {"POSITION": skinned.gltf.accessor(moves[0]), "NORMAL": skinned.gltf.accessor(moves[1])}
    ]
    skinned.node["weights"] = [0.5]
    check(skinned, tmp_path, POINTS + 0.5 * moves[0], POINTS + 0.5 * moves[1])


def test_surfaces_of_mirroring_joints_keep_their_outside(tmp_path: Path) -> None:
    """Normals and winding agree, and tangents keep their handedness on the surface."""
    skinned = Skinned(inverse=False)
    gltf = skinned.gltf
    nodes = gltf.document["nodes"]
    turned = np.diag([-1, 1, 1, 1]) @ skinned.worlds[0]
    nodes[1]["matrix"], nodes[2]["matrix"], nodes[3]["matrix"] = (
        matrix.T.ravel().tolist() for matrix in (turned, np.eye(4), np.eye(4))
    )
    side = np.cross(VERTICES, [0, 0, 1]) + [1e-3, 0, 0]
    skinned.primitive["attributes"]["TANGENT"] = gltf.accessor(np.column_stack([side, np.ones(COUNT)]))
    (mesh,) = read(gltf, tmp_path).meshes
    assert mesh.normals is not None and mesh.tangents is not None
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), mesh.normals[mesh.faces[:, 0]]) > 0).all()
    assert (mesh.tangents[:, 3] == -1).all()
    expected = side @ turned[:3, :3].T
    np.testing.assert_allclose(
        mesh.tangents[:, :3], expected / np.linalg.norm(expected, axis=1, keepdims=True), atol=1e-5
    )


def test_joints_outside_the_scene(tmp_path: Path) -> None:
    """Their own ancestors place them."""
    skinned = Skinned()
    skinned.gltf.document["scenes"] = [{"nodes": [0]}]
    check(skinned, tmp_path)


def test_without_joints_the_node_places_the_mesh(tmp_path: Path) -> None:
    skinned = Skinned()
    del skinned.primitive["attributes"]["WEIGHTS_0"]
    (mesh,) = read(skinned.gltf, tmp_path).meshes
    np.testing.assert_allclose(mesh.vertices, 100 * VERTICES + [7, 8, 9], atol=1e-4)


def test_faults_are_named(tmp_path: Path) -> None:
    skinned = Skinned()
    joints = skinned.joints.copy()
    joints[5, 2] = JOINTS
    skinned.primitive["attributes"]["JOINTS_0"] = skinned.gltf.accessor(joints, "<u1")
    with pytest.raises(SceneError, match='mesh "mesh 0": vertex 5 follows joint 3, but its skin has 3 joints; export'):
        read(skinned.gltf, tmp_path)
    weights = skinned.weights.astype(np.float32)
    weights[5, 2] = skinned.weights[5, 2] = 0
    skinned.primitive["attributes"]["WEIGHTS_0"] = skinned.gltf.accessor(weights)
    check(skinned, tmp_path)
    skinned.primitive["attributes"]["JOINTS_0"] = skinned.gltf.accessor(joints[:9], "<u1")
    with pytest.raises(SceneError, match=f'mesh "mesh 0": has 9 of JOINTS_0 for {COUNT} vertices'):
        read(skinned.gltf, tmp_path)
    skinned.primitive["attributes"]["JOINTS_0"] = skinned.gltf.accessor(joints)
    with pytest.raises(SceneError, match="its JOINTS_0 are float32; they must be unsigned integers"):
        read(skinned.gltf, tmp_path)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"joints": [1, 2, 99]}, "skin 0 uses node 99, but the file has 4"),
        ({"joints": []}, "skins[0].joints"),
        ({"joints": [1, 2, 3, 3]}, "skin 0: has 3 inverseBindMatrices for 4 joints"),
        ({"inverseBindMatrices": 0}, "skin 0: accessor 0 is VEC3, not MAT4"),
    ],
)
def test_skins_that_are_wrong(keys: dict[str, Any], words: str, tmp_path: Path) -> None:
    skinned = Skinned()
    skinned.skin |= keys
    with pytest.raises(SceneError) as caught:
        read(skinned.gltf, tmp_path)
    assert words in str(caught.value)


def test_joints_in_a_circle(tmp_path: Path) -> None:
    skinned = Skinned()
    skinned.gltf.document["nodes"][3]["children"] = [1]
    skinned.gltf.document["scenes"] = [{"nodes": [0]}]
    with pytest.raises(SceneError, match="is its own ancestor"):
        read(skinned.gltf, tmp_path)
    skinned.gltf.document["nodes"][0]["skin"] = 7
    with pytest.raises(SceneError, match="a node uses skin 7, but the file has 1"):
        read(skinned.gltf, tmp_path)


def test_matrices_that_are_not_finite(tmp_path: Path) -> None:
    skinned = Skinned()
    columns = np.tile(np.eye(4).ravel(), (JOINTS, 1))
    columns[1, 3] = np.nan
    skinned.skin["inverseBindMatrices"] = skinned.gltf.accessor(columns)
    with pytest.raises(SceneError, match=r"skin 0: inverseBindMatrices\[1\] is not finite"):
        read(skinned.gltf, tmp_path)
