"""Skins of a glTF file: vertices that follow joints (specification 3.7.3)."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...scene.geometry.transform import unit
from ...scene.model import Mesh
from . import schema as gltf
from .accessors import GltfData
from .graph import NodeGraph

Doubles = NDArray[np.float64]
#: Vertices that are moved at a time, so that their matrices take little memory.
PART = 1 << 14


class Influences(NamedTuple):
    """What moves the vertices. joints: (n, k) indices into the skin's joints; weights: (n, k), rows of sum 1."""

    joints: NDArray[np.int64]
    weights: Doubles


def read_influences(data: GltfData, primitive: gltf.Primitive, n: int, user: str) -> Influences | None:
    """Return the influences on a primitive's `n` vertices; None if it has no joints or no weights.

    All sets of four are read. Weights are divided by their sum, as renderers do, since files round them; a vertex
    without any follows its first joint.
    """
    joints, weights = list[NDArray[np.int64]](), list[Doubles]()
    while {f"JOINTS_{len(joints)}", f"WEIGHTS_{len(joints)}"} <= set(primitive.attributes):
        number = len(joints)
        indices = data.array(primitive.attributes[f"JOINTS_{number}"], "VEC4", user)
        if not np.issubdtype(indices.dtype, np.unsignedinteger):
            raise SceneError(f"{user}: its JOINTS_{number} are {indices.dtype}; they must be unsigned integers")
        shares = data.array(primitive.attributes[f"WEIGHTS_{number}"], "VEC4", user)
        for name, values in [("JOINTS", indices), ("WEIGHTS", shares)]:
            if len(values) != n:
                raise SceneError(f"{user}: has {len(values)} of {name}_{number} for {n} vertices; export it again")
        joints.append(indices.astype(np.int64))
        weights.append(np.maximum(np.where(np.isfinite(shares), shares, 0), 0).astype(np.float64))
    if not joints:
        return None
    every = np.concatenate(weights, axis=1)
    every[~every.any(axis=1), 0] = 1
    return Influences(np.concatenate(joints, axis=1), every / every.sum(axis=1, keepdims=True))


def joint_matrices(data: GltfData, graph: NodeGraph, index: int) -> Doubles:
    """Return the matrices (k, 3, 4) that take vertices from their rest pose to the world with each of a skin's joints.

    Raises SceneError for fewer inverse bind matrices than joints, and for ones that are not finite.
    """
    user = f"skin {index}"
    skin = gltf.entry(data.document.skins, index, "skin", "a node")
    worlds = np.array([graph.world(joint, user) for joint in skin.joints])
    if skin.inverseBindMatrices is None:
        return worlds[:, :3]
    stored = data.array(skin.inverseBindMatrices, "MAT4", user)
    if len(stored) < len(worlds):
        raise SceneError(f"{user}: has {len(stored)} inverseBindMatrices for {len(worlds)} joints; export it again")
    matrices = stored[: len(worlds)].astype(np.float64)
    if not np.isfinite(matrices).all():
        bad = int(np.argmin(np.isfinite(matrices).all(axis=1)))
        raise SceneError(f"{user}: inverseBindMatrices[{bad}] is not finite; export the file again")
    return np.asarray((worlds @ matrices.reshape(-1, 4, 4).transpose(0, 2, 1))[:, :3])


def skinned(mesh: Mesh, influences: Influences, joints: Doubles, user: str) -> Mesh:
    """Return the mesh in the world, moved by `joints` (k, 3, 4).

    Normals are transformed by the inverse transpose (see `transform_mesh`). Triangles at joints that mirror are
    reversed. Raises SceneError for a joint that the skin does not have, unless its weight is 0.
    """
    beyond = (influences.joints >= len(joints)) & (influences.weights > 0)
    if beyond.any():
        vertex = int(beyond.any(axis=1).argmax())
        joint = int(influences.joints[vertex][beyond[vertex]][0])
        raise SceneError(
            f"{user}: vertex {vertex} follows joint {joint}, but its skin has {len(joints)} joints; export it again"
        )
    n = len(mesh.vertices)
    vertices, mirrored = np.empty((n, 3), np.float32), np.empty(n, np.bool_)
    normals = None if mesh.normals is None else np.empty((n, 3), np.float32)
    tangents = None if mesh.tangents is None else mesh.tangents.copy()
    for part in (slice(first, first + PART) for first in range(0, n, PART)):
        blend = _blended(influences.joints[part], influences.weights[part], joints)
        linear = blend[:, :, :3]
        cofactors = np.cross(linear[:, [1, 2, 0]], linear[:, [2, 0, 1]])
        vertices[part] = _applied(linear, mesh.vertices[part]) + blend[:, :, 3]
        mirrored[part] = np.einsum("nj,nj->n", linear[:, 0], cofactors[:, 0]) < 0
        if normals is not None and mesh.normals is not None:
            turned = _applied(cofactors, unit(mesh.normals[part]))
            normals[part] = np.where(mirrored[part, None], -turned, turned)
        if tangents is not None:
            tangents[part, :3] = unit(_applied(linear, tangents[part, :3]))
    faces = mesh.faces
    if mirrored.any():
        inside_out = mirrored[faces].sum(axis=1) >= 2
        faces = np.where(inside_out[:, None], faces[:, ::-1], faces)
        if tangents is not None:
            tangents[mirrored, 3] *= -1
    return replace(mesh, vertices=vertices, faces=faces, normals=normals, tangents=tangents)


def _blended(joints: NDArray[np.int64], weights: Doubles, matrices: Doubles) -> Doubles:
    """Return each vertex's matrix, (n, 3, 4): the sum of its joints' times its weights."""
    blend = np.zeros((len(joints), 3, 4))
    for joint, weight in zip(joints.T, weights.T):
        blend += weight[:, None, None] * matrices[np.where(weight > 0, joint, 0)]
    return blend


def _applied(matrices: Doubles, vectors: NDArray[np.floating]) -> Doubles:
    """Return (n, 3): each matrix (n, 3, 3) times its vector."""
    return np.asarray(np.einsum("nij,nj->ni", matrices, vectors.astype(np.float64)))
