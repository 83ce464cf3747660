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
from ....scene.exposure import motion_of
from ....scene.geometry.instancing import prototypes
from ....scene.geometry.motion import ROUNDING
from ....scene.model import Instance
from ..records import MOTION, MOTION_NUMBER, PLACEMENT

Doubles = NDArray[np.float64]
FloatArray = NDArray[np.float32]
IntArray = NDArray[np.int64]
#: Relative rounding error of a coordinate transformed from the world to the mesh's frame (the matrix's entry, a
#: product, three sums) and back.
ROUNDINGS = 12 * 2.0**-24
#: The same for transforms that are computed for a time, twice, from a quaternion and factors of the matrix.
MOTION_ROUNDINGS = 2 * ROUNDING


class PackedInstances:
    """Instances of meshes, after the rest: everything placed directly in the world, if there is any.

    meshes: those that instances show; their triangles are stored one mesh after another, followed by those of the rest.
    before: number of triangles before the rest's. materials: (k,), each instance's. starts: first triangle of each
    mesh. mesh, to_world: mesh and transform of each placement, the rest first. moving: (m,), numbers of the placements
    that move; motion: theirs, None if there are none.
    """

    def __init__(self, instances: list[Instance], rest: bool) -> None:
        self.meshes, which = prototypes(instances)
        self.materials = [each.material or each.mesh.material for each in instances]
        self.starts = np.cumsum([0, *(len(mesh.faces) for mesh in self.meshes)])
        self.before = int(self.starts[-1])
        itself = [np.eye(3, 4)] * rest
        self.to_world = np.array([*itself, *(instance.to_world for instance in instances)])
        self.mesh = np.concatenate([np.full(len(itself), len(self.meshes), np.int32), which])
        places = [i for i, each in enumerate(instances) if each.to_world_end is not None]
        self.moving = np.array(places, np.int32) + np.int32(rest)
        self.motion = motion_of([instances[i] for i in places]) if places else None

    @property
    def paths(self) -> list[NDArray[Any]]:
        """All that defines the places of the instances at all times."""
        motion = [] if self.motion is None else [*self.motion.turn, *self.motion[1:]]
        return [self.to_world, self.moving, *motion]

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
        if self.motion is not None:
            bound = MOTION_ROUNDINGS * self.motion.to_world_bound()
            for row in range(3):
                records[f"rounding{row}"][self.moving] = bound[:, row]
            records["unit"][self.moving] = np.sign(records["unit"][self.moving]) / self.motion.size()
        return records

    def motions(self) -> dict[str, tuple[str, NDArray[Any]]]:
        """Return the buffers of kernels/geometry/motion.cl; none if nothing moves."""
        if self.motion is None:
            return {}
        motion, records = self.motion, np.zeros(len(self.moving), MOTION)
        records["middle"], records["change"], records["angle"] = motion.turn
        records["offset"], records["moved"] = motion.offset[:, 0], motion.offset[:, 1]
        records["inner"], records["outer"], records["growth"] = motion.inner, motion.outer, motion.growth
        records["from_inner"] = np.linalg.inv(motion.inner[..., :3])
        records["from_outer"] = np.linalg.inv(motion.outer)
        numbers = np.full(len(self.mesh), -1, np.int32)
        numbers[self.moving] = np.arange(len(self.moving))
        return {"motions": ("Motion", records), "motion_of": ("MotionNumber", numbers.view(MOTION_NUMBER))}


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

    def at_hits(self, primitive: NDArray[np.int32], instance: NDArray[np.int32]) -> tuple[IntArray, IntArray]:
        """Return the object and its triangle at hits as stored by the kernels, both of the same shape; −1 at misses."""
        counts = np.array([*self.faces, *[1] * self.spheres], np.int64)
        starts, rest = np.cumsum(counts) - counts, len(counts)
        others = len(self.meshes) + len(self.instances)
        objects = np.array([*self.meshes, *range(others, others + self.spheres), *self.instances, -1])
        placed = rest + instance - (rest > 0)
        which = np.where(placed < rest, np.searchsorted(starts, primitive, side="right") - 1, placed)
        first = np.concatenate([starts, np.zeros(len(objects) - rest, np.int64)])
        return np.where(primitive < 0, -1, objects[which]), primitive - first[which]
