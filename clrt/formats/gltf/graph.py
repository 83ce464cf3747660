"""Node hierarchy of a glTF document: the nodes of a scene, and every node's matrix to the world."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np

from ...errors import SceneError
from ...scene.geometry.transform import Matrix, quaternion, scaling, translation
from . import schema as gltf

Placed = tuple[gltf.Node, Matrix]
IDENTITY: Matrix = np.eye(4)


class NodeGraph:
    """Visible nodes of one of the document's scenes: `placed`, depth first, each with its matrix to the world.

    Without nodes each mesh is at the root. scene: its index; None for the default; root: the matrix from the file's
    coordinates to the world.
    """

    def __init__(self, document: gltf.Document, scene: int | None = None, root: Matrix = IDENTITY) -> None:
        self._nodes, self._root = document.nodes, root
        self._worlds: dict[int, Matrix] = {}
        self.placed: list[Placed] = list(self._shown(document, document.scene or 0 if scene is None else scene))

    def _shown(self, document: gltf.Document, scene: int) -> Iterator[Placed]:
        if not self._nodes:
            yield from ((gltf.Node(mesh=index), self._root) for index in range(len(document.meshes)))
        elif document.scenes:
            yield from self._below(gltf.entry(document.scenes, scene, "scene", "the file").nodes)
        else:
            children = {child for node in self._nodes for child in node.children}
            yield from self._below([index for index in range(len(self._nodes)) if index not in children])

    def _below(self, roots: list[int]) -> Iterator[Placed]:
        waiting = [(index, self._root) for index in reversed(roots)]
        while waiting:
            index, parent = waiting.pop()
            if index in self._worlds:
                raise SceneError(f"node {index}: has two parents or is its own ancestor; export the file again")
            node = gltf.entry(self._nodes, index, "node", "the scene")
            matrix = self._worlds[index] = parent @ _local(node, index)
            if not node.extensions.KHR_node_visibility.visible:
                continue
            yield node, matrix
            waiting += [(child, matrix) for child in reversed(node.children)]

    def world(self, index: int, user: str) -> Matrix:
        """Return a node's matrix to the world; the node may lie outside the scene, as joints of some files do."""
        path: dict[int, None] = {}
        while index not in self._worlds:
            if index in path:
                raise SceneError(f"node {index}: is its own ancestor; export the file again")
            path[index] = None
            gltf.entry(self._nodes, index, "node", user)
            if index not in self._parents:
                break
            index = self._parents[index]
        matrix = self._worlds.get(index, self._root)
        for below in reversed(path):
            matrix = self._worlds[below] = matrix @ _local(self._nodes[below], below)
        return matrix

    @cached_property
    def _parents(self) -> dict[int, int]:
        return {child: index for index, node in enumerate(self._nodes) for child in node.children}


def _local(node: gltf.Node, index: int) -> Matrix:
    """Return the node's matrix to its parent."""
    if node.matrix is not None:
        return np.array(node.matrix).reshape(4, 4).T
    if not any(node.rotation):
        raise SceneError(f"node {index}: its rotation is [0, 0, 0, 0]; write [0, 0, 0, 1] for none")
    return translation(node.translation) @ quaternion(*node.rotation) @ scaling(node.scale)
