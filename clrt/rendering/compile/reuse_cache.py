"""Reuse of BVHs and environment maps between successive scenes, as far as their inputs are unchanged."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...accel.build import build_tree
from ...accel.bvh import Triangles
from ...accel.layouts import Layout
from ...accel.two_level import TwoLevelBvh
from ...device.open import Device
from ...scene.model import Environment, Mesh
from .geometry.pack_instances import PackedInstances
from .lights.environment_map import EnvironmentMap, pack_sky

FloatArray = NDArray[np.float32]


class ReuseCache:
    """Cache of the last BVH and environment. If only instances moved, the BVH buffers are updated, also on the
    device."""

    def __init__(self) -> None:
        self._environment: Environment | None = None
        self._sky: EnvironmentMap | None = None
        self._names: tuple[Any, ...] = ()
        self._arrays: list[NDArray[Any]] = []
        self._tree: Layout | None = None
        self._levels: TwoLevelBvh | None = None
        self._to_world: NDArray[np.float64] = np.zeros(0)

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
        names = layout, builder, test, len(placements.materials), len(meshes)
        arrays = [spheres, placements.mesh, placements.starts]  # meshes' arrays are half as large as triangles
        arrays += [array for mesh in meshes for array in (mesh.vertices, mesh.faces)]
        same = names == self._names and all(map(np.array_equal, arrays, self._arrays))
        if not (self._tree and same):
            self._names, self._arrays, self._levels = names, arrays, None
            if placements.materials:
                self._levels = placements.levels(device, layout, builder, triangles, spheres, test)
            else:
                self._tree = build_tree(device, layout, builder, triangles, spheres, test)
        if self._levels and not (self._tree and same and np.array_equal(self._to_world, placements.to_world)):
            self._tree, self._to_world = self._levels.place(placements.to_world), placements.to_world
        assert self._tree
        return self._tree
