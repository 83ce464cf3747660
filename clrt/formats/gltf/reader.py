"""Reader for glTF 2.0 (.glb, .gltf): the scene's triangles, metallic-roughness materials, cameras and lights.

Unsupported features (skins, lines, ...) are listed in one logged warning.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...scene.geometry.instancing import meshes_by_id
from ...scene.geometry.normals import Normals, choose_normals
from ...scene.geometry.transform import Matrix, quaternion, scaling, translation
from ...scene.model import Mesh, Model
from ...scene.validation.validate import index_problems, mesh_problems
from ..frame_model import bounds
from . import schema as gltf
from .accessors import GltfData
from .cameras import read_cameras
from .draco import decompress
from .instancing import matrices, shown
from .lights import read_lights
from .materials import Materials
from .morph_targets import morphed, weights_of

log = logging.getLogger(__name__)
TRIANGLES, STRIP, FAN = 4, 5, 6
Placed = tuple[gltf.Node, Matrix]


def read_gltf(path: Path, normals: Normals = "file") -> Model:
    """Read the scene of a glTF file: per primitive of each node a Mesh in world coordinates, or an Instance.

    Raises SceneError naming the file and the accessor, node or mesh that is wrong.
    """
    try:
        with np.errstate(all="ignore"):  # values that are not finite are reported below
            return _read(path, normals)
    except SceneError as error:
        raise SceneError([f"{path}: {problem}" for problem in error.problems]) from None


def _read(path: Path, normals: Normals) -> Model:
    data = GltfData(path)
    nodes = list(_nodes(data.document))
    materials = Materials(data)
    meshes, instances = shown(_places(data, materials, nodes, normals))
    if not meshes and not instances:
        raise SceneError("its scene contains no triangles; export a model with triangle meshes")
    every = [*meshes, *meshes_by_id(instances).values()]
    problems = [problem for mesh in every for problem in mesh_problems(mesh, "mesh")]
    if problems:
        raise SceneError(problems)
    _warn_of_left_out(path, data.document, materials.unused)
    middle = np.mean(bounds(meshes, instances), axis=0)
    return Model(
        meshes=meshes,
        instances=instances,
        cameras=read_cameras(path, data.document, nodes, middle),
        lights=list(read_lights(data.document, nodes)),
    )


def _nodes(document: gltf.Document) -> Iterator[Placed]:
    """Yield each node of the scene with its matrix to the world. Without nodes each mesh gets the identity."""
    if not document.nodes:
        yield from ((gltf.Node(mesh=index), np.eye(4)) for index in range(len(document.meshes)))
        return
    if document.scenes:
        roots = gltf.entry(document.scenes, document.scene or 0, "scene", "the file").nodes
    else:
        children = {child for node in document.nodes for child in node.children}
        roots = [index for index in range(len(document.nodes)) if index not in children]
    waiting = [(index, np.eye(4)) for index in reversed(roots)]
    seen = set()
    while waiting:
        index, parent = waiting.pop()
        if index in seen:
            raise SceneError(f"node {index}: has two parents or is its own ancestor; export the file again")
        seen.add(index)
        node = gltf.entry(document.nodes, index, "node", "the scene")
        matrix = parent @ _local(node, index)
        yield node, matrix
        waiting += [(child, matrix) for child in reversed(node.children)]


def _local(node: gltf.Node, index: int) -> Matrix:
    """Return the node's matrix to its parent."""
    if node.matrix is not None:
        return np.array(node.matrix).reshape(4, 4).T
    if not any(node.rotation):
        raise SceneError(f"node {index}: its rotation is [0, 0, 0, 0]; write [0, 0, 0, 1] for none")
    return translation(node.translation) @ quaternion(*node.rotation) @ scaling(node.scale)


def _places(
    data: GltfData, materials: Materials, nodes: list[Placed], normals: Normals
) -> Iterator[tuple[Mesh, Matrix]]:
    """Yield the meshes of all nodes with their matrices; a mesh is read once per set of morph weights."""
    read: dict[tuple[int, tuple[float, ...]], list[Mesh]] = {}
    for node, matrix in nodes:
        if node.mesh is not None:
            weights = weights_of(node, gltf.entry(data.document.meshes, node.mesh, "mesh", "a node"))
            key = node.mesh, weights
            if key not in read:
                read[key] = list(_primitives(data, materials, node.mesh, weights, normals))
            yield from ((mesh, place) for place in matrices(data, node, matrix) for mesh in read[key])


def _primitives(
    data: GltfData, materials: Materials, index: int, weights: Sequence[float], normals: Normals
) -> Iterator[Mesh]:
    """Yield a mesh's primitives with triangles, in its own frame, with the weighted morph targets applied."""
    source = gltf.entry(data.document.meshes, index, "mesh", "a node")
    for number, primitive in enumerate(source.primitives):
        name = source.name or f"mesh {index}"
        if len(source.primitives) > 1:
            name += f" part {number}"
        where = f'mesh "{name}"'
        if primitive.mode < TRIANGLES or "POSITION" not in primitive.attributes:
            continue
        decompress(data, primitive, where)
        vertices = _vectors(data, primitive.attributes["POSITION"], where)
        corners = _corners(data, primitive, len(vertices), where)
        if len(corners) == 0:
            continue
        problems = index_problems(corners, len(vertices), where)
        if problems:
            raise SceneError(problems)
        normal, tangent, uv, uv1 = (
            _attribute(data, primitive, key, kind, len(vertices), where)
            for key, kind in [("NORMAL", "VEC3"), ("TANGENT", "VEC4"), ("TEXCOORD_0", "VEC2"), ("TEXCOORD_1", "VEC2")]
        )
        faces = corners.astype(np.int32)
        vertices = morphed(data, primitive, "POSITION", vertices, weights, where)
        normal, tangent = (
            None if values is None else morphed(data, primitive, key, values, weights, where)
            for key, values in [("NORMAL", normal), ("TANGENT", tangent)]
        )
        yield Mesh(
            vertices,
            faces,
            materials.material(primitive, where, [uv, uv1], faces),
            choose_normals(normals, vertices, faces, normal),
            name,
            uv=uv,
            uv1=uv1,
            colors=_colors(data, primitive, len(vertices), where),
            tangents=tangent if normals == "file" and normal is not None else None,
            material_name="" if primitive.material is None else materials.names[primitive.material],
        )


def _vectors(data: GltfData, accessor: int, user: str) -> NDArray[np.float32]:
    return np.ascontiguousarray(data.array(accessor, "VEC3", user), np.float32)


def _attribute(
    data: GltfData, primitive: gltf.Primitive, key: str, kind: str, n: int, user: str
) -> NDArray[np.float32] | None:
    """Return the values (n, k) of an attribute of `n` vertices; those not finite become 0, except in normals."""
    if key not in primitive.attributes:
        return None
    values = np.ascontiguousarray(data.array(primitive.attributes[key], kind, user), np.float32)
    if len(values) != n:
        raise SceneError(f"{user}: has {len(values)} of {key} for {n} vertices; export it again")
    return np.where(np.isfinite(values), values, np.float32(0)) if key != "NORMAL" else values


def _colors(data: GltfData, primitive: gltf.Primitive, n: int, user: str) -> NDArray[np.float32] | None:
    """Return linear vertex colors, with or without alpha."""
    if "COLOR_0" not in primitive.attributes:
        return None
    accessor = gltf.entry(data.document.accessors, primitive.attributes["COLOR_0"], "accessor", user)
    kind = accessor.type if accessor.type == "VEC3" else "VEC4"
    found = _attribute(data, primitive, "COLOR_0", kind, n, user)
    return None if found is None else found.clip(0, 1)


def _corners(data: GltfData, primitive: gltf.Primitive, n: int, user: str) -> NDArray[np.int64]:
    """Return the triangles (m, 3) of a primitive with `n` vertices (specification 3.7.2.1)."""
    if primitive.indices is None:
        order = np.arange(n)
    else:
        indices = data.array(primitive.indices, "SCALAR", user)
        if not np.issubdtype(indices.dtype, np.unsignedinteger):
            raise SceneError(
                f"{user}: its indices, accessor {primitive.indices}, are {indices.dtype}; "
                "they must be unsigned integers"
            )
        order = indices[:, 0].astype(np.int64)
    if primitive.mode == TRIANGLES or primitive.indices in data.decoded:
        if len(order) % 3:
            raise SceneError(f"{user}: has {len(order)} corners, which is not a multiple of 3; export it again")
        return order.reshape(-1, 3)
    first = np.arange(max(len(order) - 2, 0))
    if primitive.mode == FAN:
        corners = np.stack([first + 1, first + 2, np.zeros_like(first)], axis=1)
    else:
        odd = first % 2
        corners = np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)
    return order[corners]


def _warn_of_left_out(path: Path, document: gltf.Document, unused: Mapping[str, Sequence[str]]) -> None:
    """Log one warning that lists what is not rendered. unused: features by material."""
    primitives = [primitive for mesh in document.meshes for primitive in mesh.primitives]
    left_out = {
        "skins": any(node.skin is not None for node in document.nodes),
        "points and lines": any(primitive.mode < TRIANGLES for primitive in primitives),
    }
    names = [name for name, present in left_out.items() if present]
    names += sorted(f"the extension {name}" for name in set(document.extensionsUsed) - gltf.EXTENSIONS)
    names += [f'{" and ".join(features)} of material "{name}"' for name, features in unused.items()]
    if names:
        log.warning("%s: left out: %s", path, ", ".join(names))
