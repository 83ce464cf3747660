"""Packing of instances: their two-level BVH, and their transforms (kernels/surface/instance_transform.cl)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....accel.bvh import Triangles
from ....accel.two_level import TwoLevelBvh, inverse
from ....device.open import Device
from ....scene.geometry.instancing import prototypes
from ....scene.model import Instance
from ..records import PLACEMENT

Doubles = NDArray[np.float64]
FloatArray = NDArray[np.float32]
IntArray = NDArray[np.int64]
#: Relative rounding error of a coordinate transformed from the world to the mesh's frame (the matrix's entry, a
#: product, three sums) and back.
ROUNDINGS = 12 * 2.0**-24


class PackedInstances:
    """Instances of meshes, after the rest: everything placed directly in the world, if there is any.

    meshes: those that instances show; their triangles are stored one mesh after another, followed by those of the rest.
    before: number of triangles before the rest's. materials: (k,), each instance's. starts: first triangle of each
    mesh. mesh, to_world: mesh and transform of each placement, the rest first.
    """

    def __init__(self, instances: list[Instance], rest: bool) -> None:
        self.meshes, which = prototypes(instances)
        self.materials = [each.material or each.mesh.material for each in instances]
        self.starts = np.cumsum([0, *(len(mesh.faces) for mesh in self.meshes)])
        self.before = int(self.starts[-1])
        itself = [np.eye(3, 4)] * rest
        self.to_world = np.array([*itself, *(instance.to_world for instance in instances)])
        self.mesh = np.concatenate([np.full(len(itself), len(self.meshes), np.int32), which])

    def levels(
        self,
        device: Device | None,
        layout: str,
        builder: str | None,
        triangles: Triangles,
        spheres: FloatArray,
        test: str,
    ) -> TwoLevelBvh:
        """Return the BVHs over triangles, stored as above, and spheres (s, 4), which belong to the rest."""
        meshes = np.split(np.asarray(triangles), self.starts[1:])
        return TwoLevelBvh(device, layout, builder, meshes, self.mesh, test, spheres)

    def records(self, codes: NDArray[np.int32]) -> NDArray[Any]:
        """Return PLACEMENT records. codes: (k,) int32, of the instances' materials."""
        linear = self.to_world[..., :3]
        records = np.zeros(len(self.mesh), PLACEMENT)
        records["to_world"] = self.to_world
        rounding = ROUNDINGS * np.abs(linear) @ np.abs(inverse(self.to_world)[..., :3])
        for row in range(3):
            records[f"rounding{row}"] = rounding[:, row]
        records["first"] = self.starts[self.mesh]
        records["material"] = np.concatenate([np.full(len(records) - len(codes), -1), codes])
        records["unit"] = np.sign(np.linalg.det(linear)) / np.abs(linear).max(axis=(1, 2))
        return records


@dataclass(frozen=True)
class ObjectIds:
    """Mapping from packed primitives to a scene's objects. faces: (m,) triangle counts of the meshes of the rest;
    spheres: their number.

    meshes, instances: (m,) and (k,), object numbers of the meshes of the rest and of the placements. Objects are
    numbered in the order: the scene's meshes, its instances, its spheres.
    """

    faces: Sequence[int]
    spheres: int
    meshes: Sequence[int]
    instances: Sequence[int]

    def met(self, primitive: NDArray[np.int32], instance: NDArray[np.int32]) -> tuple[IntArray, IntArray]:
        """Return the object and its triangle at hits as stored by the kernels, both of the same shape; −1 at misses."""
        counts = np.array([*self.faces, *[1] * self.spheres], np.int64)
        starts, rest = np.cumsum(counts) - counts, len(counts)
        others = len(self.meshes) + len(self.instances)
        objects = np.array([*self.meshes, *range(others, others + self.spheres), *self.instances, -1])
        placed = rest + instance - (rest > 0)
        which = np.where(placed < rest, np.searchsorted(starts, primitive, side="right") - 1, placed)
        first = np.concatenate([starts, np.zeros(len(objects) - rest, np.int64)])
        return np.where(primitive < 0, -1, objects[which]), primitive - first[which]
