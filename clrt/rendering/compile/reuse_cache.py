"""Reuse of BVHs and environment maps between successive scenes, as far as their inputs are unchanged."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...accel.build import build_tree
from ...accel.bvh import Triangles
from ...accel.layouts import Layout
from ...accel.refit import can_refit
from ...accel.two_level import TwoLevelBvh
from ...device.open import Device
from ...scene.model import Environment, Mesh
from .geometry.pack_instances import PackedInstances
from .lights.environment_map import EnvironmentMap, pack_sky
from .moved_tree import MovedTree

FloatArray = NDArray[np.float32]


def _all_equal(arrays: list[NDArray[Any]], others: list[NDArray[Any]]) -> bool:
    """Return whether two lists have equal arrays."""
    return len(arrays) == len(others) and all(map(np.array_equal, arrays, others))


class ReuseCache:
    """Cache of the last BVH and environment. If only instances or only vertices moved, the BVH buffers are updated,
    also on the device."""

    def __init__(self) -> None:
        self._environment: Environment | None = None
        self._sky: EnvironmentMap | None = None
        self._names: tuple[Any, ...] = ()
        self._fixed: list[NDArray[Any]] = []
        self._vertices: list[FloatArray] = []
        self._tree: Layout | None = None
        self._levels: TwoLevelBvh | None = None
        self._moved: MovedTree | None = None
        self._places: list[NDArray[Any]] = []

    def sky(self, environment: Environment) -> EnvironmentMap:
        """Return `pack_sky` of the environment, cached while it is the same object."""
        if self._sky is None or environment is not self._environment:
            self._sky, self._environment = pack_sky(environment), environment
        return self._sky

    def tree(
        self,
        device: Device | None,
        layout: str,
        builder: str | None,
        meshes: list[Mesh],
        triangles: Triangles,
        spheres: FloatArray,
        test: str,
        placements: PackedInstances,
    ) -> Layout:
        """Return the BVH over the meshes' triangles and spheres (s, 4), and over instances if there are any."""
        names = layout, builder, test, len(placements.materials), *(len(mesh.vertices) for mesh in meshes)
        # The meshes' arrays are half as large as their triangles.
        fixed = [spheres, placements.mesh, placements.starts, *(mesh.faces for mesh in meshes)]
        vertices = [mesh.vertices for mesh in meshes]
        alike = names == self._names and all(map(np.array_equal, fixed, self._fixed))
        last, self._tree = self._tree, None
        same = bool(last) and alike and all(map(np.array_equal, vertices, self._vertices))
        if not same:
            refits = bool(last) and alike and not self._levels
            self._names, self._fixed, self._vertices, self._levels = names, fixed, vertices, None
            if placements.materials:
                self._levels = placements.levels(device, layout, builder, triangles, spheres, test)
            elif (moved := self._refitted(device, last, meshes) if refits else None) is not None:
                last = moved
            else:
                self._moved, last = None, build_tree(device, layout, builder, triangles, spheres, test)
        places = placements.paths
        if self._levels and not (same and _all_equal(places, self._places)):
            last = self._levels.place(
                placements.to_world, placements.moving, placements.motion and placements.motion.boxes
            )
            self._places = places
        assert last
        self._tree = last
        return last

    def _refitted(self, device: Device | None, last: Layout | None, meshes: list[Mesh]) -> Layout | None:
        """Return the last BVH, refitted to the meshes' moved vertices; None if a new one is better, or its layout does
        not allow it."""
        if device is None or last is None or not can_refit(last):
            return None
        self._moved = self._moved or MovedTree(device, last, meshes)
        return self._moved.refit(meshes)
