"""The BVH of a scene whose vertices move from image to image, refitted instead of built again."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...accel.layouts import Layout
from ...accel.refit import Refitter, relative_area
from ...device.launches.device_arrays import resident
from ...device.open import Device
from ...scene.model import Mesh

#: A BVH whose boxes have grown by more than this factor is built again: rays hit as many more of them.
WORSE = 2.0


class MovedTree:
    """Refitter of one BVH over the triangles of all meshes, in their order; `tree` is a copy on the device."""

    def __init__(self, device: Device, tree: Layout, meshes: Sequence[Mesh]) -> None:
        self._device = device
        self.tree = replace(tree, buffers={name: resident(device, array) for name, array in tree.buffers.items()})
        self._area = relative_area(device, self.tree)
        counts = [len(mesh.vertices) for mesh in meshes]
        firsts = np.cumsum([0, *counts])[:-1]
        faces = [mesh.faces + np.int32(first) for mesh, first in zip(meshes, firsts)]
        self._refitter = Refitter(device, self.tree, np.concatenate(faces), sum(counts))

    def refit(self, meshes: Sequence[Mesh]) -> Layout | None:
        """Return the BVH over the moved meshes; None if a new one would be much faster, as neighbors moved apart."""
        start = time.perf_counter()
        self._refitter.refit(np.concatenate([mesh.vertices for mesh in meshes]))
        if relative_area(self._device, self.tree) > WORSE * self._area:
            return None
        self.tree = replace(self.tree, build_seconds=time.perf_counter() - start)
        return self.tree
