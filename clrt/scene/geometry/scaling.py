"""Scaling and translation of scenes to coordinates in which float32 neither overflows nor loses precision.

A triangle test multiplies three lengths, so edges of 1e-20 or 1e15 exceed float32's range although the scene itself
does not; multiplying all lengths by a power of two is exact and does not change the image. And a scene far from the
origin has little precision left relative to its own size, where rays leave its surfaces; translating it back is exact,
since subtracting numbers close to each other is (Sterbenz 1974).
"""

from __future__ import annotations

from dataclasses import replace
from math import frexp
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..lights import Light
from ..model import Camera, Instance, Mesh, Scene, Sphere, Vector
from ..ray_list import RayList
from .instancing import meshes_by_id

#: Scenes whose largest coordinate (the camera's excluded) lies between 2^-20 and 2^20 are not scaled.
COMFORTABLE = 20
#: Maximum absolute exponent of a unit.
MOST = 126
#: A scene is translated along an axis only if its center is this many times half its largest extent from 0.
FAR = 4.0


class SceneFrame(NamedTuple):
    """Coordinate frame on the device: a point p becomes (p − center)·unit. unit: a power of two."""

    center: Vector = (0.0, 0.0, 0.0)
    unit: float = 1.0

    def points(self, points: NDArray[np.floating]) -> NDArray[np.float32]:
        """Return points (…, 3) in this frame."""
        if self == SceneFrame():
            return points.astype(np.float32, copy=False)
        with np.errstate(over="ignore"):
            return np.asarray((points - np.array(self.center)) * self.unit, np.float32)

    def point(self, point: Vector) -> Vector:
        """Return one point in this frame."""
        x, y, z = ((p - c) * self.unit for p, c in zip(point, self.center))
        return x, y, z


def frame_around(low: NDArray[np.floating], high: NDArray[np.floating]) -> SceneFrame:
    """Return the frame for a bounding box; low, high: (3,), or inf and −inf for an empty one."""
    low, high = low.astype(np.float64), high.astype(np.float64)
    if not np.all(low <= high):
        return SceneFrame()
    middle, half = (low + high) / 2, float((high - low).max()) / 2
    center = np.where(np.abs(middle) > FAR * half, middle, 0).astype(np.float32).astype(np.float64)
    x, y, z = center.tolist()
    return SceneFrame((x, y, z), unit_for(float(np.maximum(np.abs(low - center), np.abs(high - center)).max())))


def unit_for(largest: float) -> float:
    """Return the power of two (a normal float32) that scales the largest coordinate to about 1; 1 if not needed."""
    exponent = max(-MOST, min(MOST, frexp(largest)[1]))
    return 1.0 if largest == 0 or abs(exponent) <= COMFORTABLE else 2.0**-exponent


def frame_of(scene: Scene) -> SceneFrame:
    """Return the frame for the scene's surfaces."""
    balls = [(np.array(sphere.center), sphere.radius) for sphere in scene.spheres]
    boxes = [_box(mesh) for mesh in scene.meshes if mesh.vertices.size] + _instance_boxes(scene.instances)
    low = [box[0] for box in boxes] + [center - radius for center, radius in balls]
    high = [box[1] for box in boxes] + [center + radius for center, radius in balls]
    return frame_around(np.min(low, axis=0), np.max(high, axis=0)) if low else SceneFrame()


def _box(mesh: Mesh) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    # Per column: numpy's min(axis=0) of three columns takes twenty times as long.
    return np.array([x.min() for x in mesh.vertices.T]), np.array([x.max() for x in mesh.vertices.T])


def _instance_boxes(instances: list[Instance]) -> list[tuple[NDArray[np.floating], NDArray[np.floating]]]:
    """Return bounding boxes of the meshes' boxes under the instances' transforms."""
    own = {key: np.array(_box(mesh), np.float64) for key, mesh in meshes_by_id(instances).items()}
    boxes = []
    for each in instances:
        low, high = own[id(each.mesh)]
        for matrix in (each.to_world, each.to_world_end):
            if matrix is not None:
                middle, half = matrix @ [*(low + high) / 2, 1.0], np.abs(matrix[:, :3]) @ (high - low) / 2
                boxes.append((middle - half, middle + half))
    return boxes


def in_frame(scene: Scene, frame: SceneFrame) -> Scene:
    """Return the scene in a frame, with point and spot lights scaled so that the image stays the same; each instanced
    mesh gets a frame of its own."""
    scene = replace(scene, instances=_instances(scene.instances, frame))
    if frame == SceneFrame():
        return scene
    return replace(
        scene,
        meshes=[
            replace(mesh, vertices=frame.points(mesh.vertices), material=mesh.material.in_unit(frame.unit))
            for mesh in scene.meshes
        ],
        camera=camera_in(scene.camera, frame),
        spheres=[_sphere(sphere, frame) for sphere in scene.spheres],
        lights=[_light(light, frame) for light in scene.lights],
    )


def _instances(instances: list[Instance], frame: SceneFrame) -> list[Instance]:
    """Return instances whose meshes are each in the frame around it, with transforms from there to `frame`."""
    meshes = meshes_by_id(instances)
    own = {key: frame_around(*_box(mesh)) for key, mesh in meshes.items()}
    framed = {
        key: replace(mesh, vertices=own[key].points(mesh.vertices), material=mesh.material.in_unit(frame.unit))
        for key, mesh in meshes.items()
    }
    placed = []
    for each in instances:
        around = own[id(each.mesh)]
        end, pivot = each.to_world_end, each.pivot
        if end is not None:
            end, pivot = (
                _between(end, around, frame),
                _between(np.eye(3, 4) if pivot is None else pivot, around, SceneFrame()),
            )
        placed.append(
            replace(
                each,
                mesh=framed[id(each.mesh)],
                to_world=_between(each.to_world, around, frame),
                material=each.material and each.material.in_unit(frame.unit),
                to_world_end=end,
                pivot=pivot,
            )
        )
    return placed


def _between(matrix: NDArray[np.float64], around: SceneFrame, frame: SceneFrame) -> NDArray[np.float64]:
    """Return an affine matrix (3, 4) whose points are in the frame `around`, and their images in `frame`."""
    linear = matrix[:, :3] * (frame.unit / around.unit)
    return np.column_stack([linear, (matrix @ [*around.center, 1.0] - frame.center) * frame.unit])


def camera_in(camera: Camera, frame: SceneFrame) -> Camera:
    """Return a camera in a frame."""
    moved = replace(
        camera.scaled(frame.unit), position=frame.point(camera.position), look_at=frame.point(camera.look_at)
    )
    if moved.end:
        ends: dict[str, Any] = {
            name: frame.point(at) for name, at in moved.end.changes.items() if name in ("position", "look_at")
        }
        moved = replace(moved, end=replace(moved.end, **ends))
    return replace(moved, origins=frame.points(moved.origins)) if isinstance(moved, RayList) else moved


def _sphere(sphere: Sphere, frame: SceneFrame) -> Sphere:
    return replace(
        sphere,
        center=frame.point(sphere.center),
        radius=sphere.radius * frame.unit,
        material=sphere.material.in_unit(frame.unit),
    )


def _light(light: Light, frame: SceneFrame) -> Light:
    moved: dict[str, Any] = {name: frame.point(value) for name, value in vars(light).items() if name == "position"}
    return replace(light.in_unit(frame.unit), **moved)
