"""Poses of random animated hierarchies, skins and morph targets, against the specification's formulas in float64.

The reference interpolates with scipy and walks the hierarchy upwards, vertex by vertex.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline, interp1d
from scipy.spatial.transform import Rotation, Slerp

import clrt
from clrt.scene.geometry.instancing import unfolded

from ..covering import others
from ..scene.shapes import icosphere
from .glb import Gltf

Doubles = NDArray[np.float64]
VERTICES, FACES = icosphere(0)
COUNT = len(VERTICES)
REST = {"translation": [0, 0, 0], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1]}


class Drawn:
    """A random file. `nodes`: their properties at rest; `curves`: times, values and interpolation by node and property;
    `parents`; the first node has a rigid mesh with morph targets, the second the same, skinned."""

    def __init__(self, seed: int) -> None:
        self.rng = rng = np.random.default_rng(seed)
        self.gltf, self.curves = Gltf(), dict[tuple[int, str], tuple[Doubles, Doubles, str]]()
        count = int(rng.integers(4, 9))
        self.parents: list[int | None] = [None, *(int(rng.integers(-1, k)) for k in range(1, count))]
        self.parents = [None if parent == -1 else parent for parent in self.parents]
        self.targets = self._single(rng.normal(size=(int(rng.integers(1, 4)), COUNT, 3)))
        self.nodes = [self._node() for _ in range(count)]
        self.joints = rng.permutation(count)[: int(rng.integers(2, count))]
        self.inverse = np.tile(np.eye(4), (len(self.joints), 1, 1))
        self.inverse[:, :3] = self._single(rng.normal(size=(len(self.joints), 3, 4)))
        self.influences = rng.integers(0, len(self.joints), (COUNT, 4))
        self.weights = self._single(rng.dirichlet(np.ones(4), COUNT))
        self._write()

    def _single(self, values: Doubles) -> Doubles:
        return values.astype(np.float32).astype(np.float64)

    def _node(self) -> dict[str, Any]:
        """Return some properties; the others are at their defaults, as are weights of 0."""
        drawn = {
            "translation": self._single(self.rng.normal(size=3)).tolist(),
            "rotation": self._single(Rotation.random(rng=self.rng).as_quat()).tolist(),
            "scale": self._single(self.rng.uniform(-1.5, 1.5, 3)).tolist(),
        }
        return {name: value for name, value in drawn.items() if self.rng.random() < 0.7}

    def _write(self) -> None:
        gltf = self.gltf
        positions = gltf.accessor(VERTICES)
        targets = [{"POSITION": gltf.accessor(each)} for each in self.targets]
        joints = {
            "JOINTS_0": gltf.accessor(self.influences, "<u1"),
            "WEIGHTS_0": gltf.accessor(self.weights),
        }
        faces = gltf.accessor(FACES.ravel(), "<u2")
        gltf.document["meshes"] = [
            {"primitives": [{"attributes": {"POSITION": positions, **more}, "indices": faces, "targets": targets}]}
            for more in ({}, joints)
        ]
        for number, node in enumerate(self.nodes):
            children = [child for child, parent in enumerate(self.parents) if parent == number]
            shown = {"mesh": number, **({"skin": 0} if number else {})} if number < 2 else {}
            gltf.node(self.parents[number] is None, **node, **shown, **({"children": children} if children else {}))
        columns = self.inverse.transpose(0, 2, 1).reshape(-1, 16)
        gltf.document["skins"] = [{"joints": self.joints.tolist(), "inverseBindMatrices": gltf.accessor(columns)}]
        samplers, channels = list[dict[str, Any]](), list[dict[str, Any]]()
        for number in range(len(self.nodes)):
            for name in [*REST, *(["weights"] if number < 2 else [])]:
                if self.rng.random() < 0.6:
                    channels.append({"sampler": len(samplers), "target": {"node": number, "path": name}})
                    samplers.append(self._sampler(number, name))
        gltf.document["animations"] = [{"samplers": samplers, "channels": channels}]

    def _sampler(self, node: int, name: str) -> dict[str, Any]:
        rng, kind = self.rng, str(self.rng.choice(["LINEAR", "STEP", "CUBICSPLINE"]))
        keys = int(rng.integers(1, 5))
        size = len(self.targets) if name == "weights" else len(REST[name])
        times = self._single(np.cumsum(rng.uniform(0.1, 1, keys)))
        values = self._single(rng.normal(size=(keys, 3 if kind == "CUBICSPLINE" else 1, size)))
        if name == "rotation" and kind != "CUBICSPLINE":
            values /= np.linalg.norm(values, axis=2, keepdims=True)
            values = self._single(values)
        self.curves[node, name] = times, values, kind
        rows = values.reshape(-1) if name == "weights" else values.reshape(-1, size)
        return {"input": self.gltf.accessor(times), "output": self.gltf.accessor(rows), "interpolation": kind}

    def at(self, node: int, name: str, time: float) -> Doubles:
        """Return a property's value at a time."""
        if (node, name) not in self.curves:
            rest = np.zeros(len(self.targets)) if name == "weights" else REST[name]
            return np.array(self.nodes[node].get(name, rest), np.float64)
        times, values, kind = self.curves[node, name]
        time, middle = float(np.clip(time, times[0], times[-1])), values[:, values.shape[1] // 2]
        if len(times) == 1:
            return np.asarray(middle[0])
        if kind == "STEP":
            return np.asarray(interp1d(times, middle, "previous", axis=0)(time))
        if kind == "CUBICSPLINE":
            piece = min(int(np.searchsorted(times, time, "right")) - 1, len(times) - 2)
            slopes = [values[piece, 2], values[piece + 1, 0]]
            return np.asarray(CubicHermiteSpline(times[piece : piece + 2], middle[piece : piece + 2], slopes)(time))
        if name == "rotation":
            return np.asarray(Slerp(times, Rotation.from_quat(middle))(time).as_quat())
        return np.asarray(interp1d(times, middle, axis=0)(time))

    def world(self, node: int | None, time: float) -> Doubles:
        if node is None:
            return np.eye(4)
        local = np.eye(4)
        turn = Rotation.from_quat(self.at(node, "rotation", time)).as_matrix()
        local[:3, :3] = turn * self.at(node, "scale", time)
        local[:3, 3] = self.at(node, "translation", time)
        return np.asarray(self.world(self.parents[node], time) @ local)

    def vertices(self, time: float) -> Doubles:
        """Return the vertices (2, COUNT, 3) of the rigid and of the skinned mesh."""
        points = [VERTICES + np.tensordot(self.at(node, "weights", time), self.targets, 1) for node in (0, 1)]
        rows = [[self.world(0, time) @ [*point, 1] for point in points[0]]]
        matrices = [self.world(int(joint), time) @ inverse for joint, inverse in zip(self.joints, self.inverse)]
        shares = self.weights / self.weights.sum(axis=1, keepdims=True)
        rows.append(
            [
                sum(share * matrices[joint] @ [*point, 1] for joint, share in zip(influences, row))
                for point, influences, row in zip(points[1], self.influences, shares)
            ]
        )
        return np.array(rows)[..., :3]


@pytest.mark.parametrize("seed", [*range(4), *others(*range(4, 12))])
def test_poses_are_the_specifications(seed: int, tmp_path: Path) -> None:
    """At random times, before, between and after the keyframes, of each frame and of each still."""
    drawn = Drawn(seed)
    path = drawn.gltf.write(tmp_path / "a.glb")
    scene = clrt.load(path, animation=0)
    for number, still in list(clrt.frames(scene))[::7]:
        expected = drawn.vertices(number / 24)
        found = np.array([mesh.vertices for mesh in unfolded(still).meshes])
        np.testing.assert_allclose(found, expected, atol=5e-6 * np.abs(expected).max())
    for time in drawn.rng.uniform(-0.5, 4, 4):
        expected = drawn.vertices(time)
        found = np.array([mesh.vertices for mesh in clrt.load(path, time=float(time)).meshes])
        np.testing.assert_allclose(found, expected, atol=5e-6 * np.abs(expected).max())
