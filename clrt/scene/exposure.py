"""What moves while the camera's shutter is open."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .cameras import OPTIONAL_LENGTHS
from .geometry.motion import Motion, Turns
from .model import Camera, Instance, Scene


def is_moving(instance: Instance) -> bool:
    """Return whether an instance moves during an exposure."""
    return instance.to_world_end is not None and not np.array_equal(instance.to_world_end, instance.to_world)


def still(instance: Instance) -> Instance:
    """Return the instance as it is when the shutter opens."""
    return instance if instance.to_world_end is None else replace(instance, to_world_end=None, pivot=None)


def exposed(scene: Scene) -> Scene:
    """Return the scene with only those instances moving that do so during the camera's exposure."""
    lasts = scene.camera.exposure > 0
    return replace(scene, instances=[each if lasts and is_moving(each) else still(each) for each in scene.instances])


def motion_features(scene: Scene) -> set[str]:
    """Return the features of programs in which the camera or instances move."""
    has = {
        "CAMERA_MOTION": scene.camera.moves,
        "MOTION": scene.camera.exposure > 0 and any(map(is_moving, scene.instances)),
    }
    return {name for name, present in has.items() if present}


def motion_of(instances: list[Instance]) -> Motion:
    """Return the motion of k moving instances, by the fraction of the exposure."""
    start = np.array([each.to_world for each in instances]).reshape(-1, 3, 4)
    end = np.array([each.to_world_end for each in instances]).reshape(-1, 3, 4)
    pivot = np.array([np.eye(3, 4) if each.pivot is None else each.pivot for each in instances]).reshape(-1, 3, 4)
    return Motion.between(start, end, pivot)


def camera_at(camera: Camera, s: float) -> Camera:
    """Return the camera at the fraction s of its exposure, without motion: its pose is that of the kernels; its lens
    changes linearly, fov_degrees by its tangent."""
    if not camera.moves:
        return replace(camera, end=None)
    end = camera.at_end
    turn = Turns.between(*(frame_of_camera(each)[None] for each in (camera, end))).at(s)[0]
    mixed: dict[str, Any] = {"position": _mixed(s, camera.position, end.position), "up": turn[:, 1]}
    reach = [np.linalg.norm(np.subtract(each.look_at, each.position)) for each in (camera, end)]
    mixed["look_at"] = mixed["position"] - turn[:, 2] * _mixed(s, *reach)
    tangents = [np.tan(np.radians(each.fov_degrees) / 2) for each in (camera, end)]
    mixed["fov_degrees"] = float(np.degrees(2 * np.arctan(_mixed(s, *tangents))))
    for name in OPTIONAL_LENGTHS:
        if (length := getattr(camera, name)) is not None:
            mixed[name] = float(_mixed(s, length, getattr(end, name)))
    return replace(camera, end=None, **mixed)


def frame_of_camera(camera: Camera) -> NDArray[np.float64]:
    """Return the rotation (3, 3) whose columns are right, up and back."""
    return camera.world_to_camera[:3, :3].T * (1.0, -1.0, -1.0)


def middle_of_rows(camera: Camera, height: int) -> NDArray[np.float64]:
    """Return the middle of each row's exposure, (height,), as fractions of the image's."""
    opened = camera.shutter[1] - camera.shutter[0]
    return np.asarray((opened / 2 + camera.rolling_shutter * np.arange(height) / height) / camera.exposure)


def _mixed(s: float, start: ArrayLike, end: ArrayLike) -> NDArray[np.float64]:
    return (1 - s) * np.asarray(start, np.float64) + s * np.asarray(end, np.float64)
