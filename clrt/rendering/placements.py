"""Packs instances: their tree of two levels, and where each stands (kernels/placement.cl)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..accel.tree import Triangles
from ..accel.two_level import TwoLevels, inverse
from ..device.open import Device
from ..scene.instancing import prototypes
from ..scene.model import Instance
from .records import PLACEMENT

Doubles = NDArray[np.float64]
FloatArray = NDArray[np.float32]
IntArray = NDArray[np.int64]
#: Of a coordinate's way from the world to the mesh's frame (the matrix's entry, a product, three sums) and back.
ROUNDINGS = 12 * 2.0**-24


class Placements:
    """Which meshes stand where. First comes the rest: what stands in the world as it is, if there is such.

    meshes: those that instances show; their triangles are stored one mesh after another, the rest's behind them.
    before: how many come before the rest's. materials: (k,), each instance's. starts: where each mesh's begin. mesh,
    to_world: which one stands where, and how, the rest first.
    """

    def __init__(self, instances: list[Instance], rest: bool) -> None:
        self.meshes, which = prototypes(instances)
        self.materials = [each.material or each.mesh.material for each in instances]
        self.starts = np.cumsum([0, *(len(mesh.faces) for mesh in self.meshes)])
        self.before = int(self.starts[-1])
        itself = [np.eye(3, 4)] * rest
        self.to_world = np.array([*itself, *(instance.to_world for instance in instances)])
        self.mesh = np.concatenate([np.full(len(itself), len(self.meshes), np.int32), which])

    def levels(self, device: Device | None, layout: str, builder: str | None, triangles: Triangles,
               spheres: FloatArray, test: str) -> TwoLevels:
        """The trees over triangles, stored as above, and spheres (s, 4), which belong to the rest."""
        meshes = np.split(np.asarray(triangles), self.starts[1:])
        return TwoLevels(device, layout, builder, meshes, self.mesh, test, spheres)

    def records(self, codes: NDArray[np.int32]) -> NDArray[Any]:
        """PLACEMENT records. codes: (k,) int32, of the instances' materials."""
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
class Objects:
    """What the objects of a scene became. faces: (m,) how many triangles each mesh of the rest has; spheres: how many.

    meshes, instances: (m,) and (k,), which objects those of the rest and the placements are. They are numbered: first
    the scene's meshes, then its instances, then its spheres.
    """

    faces: Sequence[int]
    spheres: int
    meshes: Sequence[int]
    instances: Sequence[int]

    def met(self, primitive: NDArray[np.int32], instance: NDArray[np.int32]) -> tuple[IntArray, IntArray]:
        """The object, and which triangle of it, at hits as the kernels have them, both of one shape; −1 at misses."""
        counts = np.array([*self.faces, *[1] * self.spheres], np.int64)
        starts, rest = np.cumsum(counts) - counts, len(counts)
        others = len(self.meshes) + len(self.instances)
        objects = np.array([*self.meshes, *range(others, others + self.spheres), *self.instances, -1])
        placed = rest + instance - (rest > 0)
        which = np.where(placed < rest, np.searchsorted(starts, primitive, side="right") - 1, placed)
        first = np.concatenate([starts, np.zeros(len(objects) - rest, np.int64)])
        return np.where(primitive < 0, -1, objects[which]), primitive - first[which]
