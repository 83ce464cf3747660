"""The BVH of a scene whose vertices move from image to image, refitted instead of built again."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...accel.layouts import Layout
from ...accel.refit import Refitter
from ...device.launches.device_arrays import resident
from ...device.open import Device
from ...scene.model import Mesh


class MovedTree:
    """Refitter of one BVH over the triangles of all meshes, in their order; `tree` is on the device.

    The first `refit` copies the BVH there; later ones overwrite it.
    """

    def __init__(self, device: Device, tree: Layout, meshes: Sequence[Mesh]) -> None:
        self._device = device
        self.tree = replace(tree, buffers={name: resident(device, array) for name, array in tree.buffers.items()})
        counts = [len(mesh.vertices) for mesh in meshes]
        firsts = np.cumsum([0, *counts])[:-1]
        faces = [mesh.faces + np.int32(first) for mesh, first in zip(meshes, firsts)]
        self._refitter = Refitter(device, self.tree, np.concatenate(faces), sum(counts))

    def refit(self, meshes: Sequence[Mesh]) -> Layout:
        """Return the BVH over the moved meshes."""
        start = time.perf_counter()
        self._refitter.refit(np.concatenate([mesh.vertices for mesh in meshes]))
        self.tree = replace(self.tree, build_seconds=time.perf_counter() - start)
        return self.tree
