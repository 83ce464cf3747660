"""Reader for glTF 2.0 (.glb, .gltf): the scene's triangles, metallic-roughness materials, cameras and lights.

Unsupported features (lines, unknown extensions, ...) are listed in one logged warning.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ...errors import SceneError
from ...scene.geometry.instancing import meshes_by_id
from ...scene.geometry.normals import Normals
from ...scene.geometry.transform import Matrix
from ...scene.model import Mesh, Model
from ...scene.validation.validate import mesh_problems
from ..frame_model import bounds
from . import schema as gltf
from .accessors import GltfData
from .cameras import read_cameras
from .graph import NodeGraph
from .instancing import matrices, shown
from .lights import read_lights
from .materials import Materials
from .morph_targets import weights_of
from .primitives import TRIANGLES, Primitives
from .skins import joint_matrices

log = logging.getLogger(__name__)
#: Mesh, primitive and morph weights, which determine a shape.
Shape = tuple[int, int, tuple[float, ...]]


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
    graph, materials = NodeGraph(data.document), Materials(data)
    meshes, instances = shown(_places(data, Primitives(data, materials, normals), graph, {}))
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
        cameras=read_cameras(path, data.document, graph.placed, middle),
        lights=list(read_lights(data.document, graph.placed)),
    )


def _places(
    data: GltfData, primitives: Primitives, graph: NodeGraph, shapes: dict[Shape, Mesh]
) -> Iterator[tuple[Mesh, Matrix]]:
    """Yield the meshes of all nodes with their matrices; shapes: a mesh is shaped once per set of morph weights.

    A skinned mesh is in the world already, whatever its node's own transform is (specification 3.7.3.3).
    """
    for node, matrix in graph.placed:
        if node.mesh is None:
            continue
        weights = weights_of(node, gltf.entry(data.document.meshes, node.mesh, "mesh", "a node"))
        joints = None if node.skin is None else joint_matrices(data, graph, node.skin)
        rigid, bent = list[Mesh](), list[Mesh]()
        for number, stored in enumerate(primitives.of(node.mesh)):
            if joints is not None and stored.influences is not None:
                bent.append(primitives.shaped(stored, weights, joints))
                continue
            key = node.mesh, number, weights
            if key not in shapes:
                shapes[key] = primitives.shaped(stored, weights)
            rigid.append(shapes[key])
        yield from ((mesh, place) for place in matrices(data, node, matrix) for mesh in rigid)
        yield from ((mesh, np.eye(4)) for mesh in bent)


def _warn_of_left_out(path: Path, document: gltf.Document, unused: Mapping[str, Sequence[str]]) -> None:
    """Log one warning that lists what is not rendered. unused: features by material."""
    primitives = [primitive for mesh in document.meshes for primitive in mesh.primitives]
    left_out = {
        "points and lines": any(primitive.mode < TRIANGLES for primitive in primitives),
    }
    names = [name for name, present in left_out.items() if present]
    names += sorted(f"the extension {name}" for name in set(document.extensionsUsed) - gltf.EXTENSIONS)
    names += [f'{" and ".join(features)} of material "{name}"' for name, features in unused.items()]
    if names:
        log.warning("%s: left out: %s", path, ", ".join(names))
