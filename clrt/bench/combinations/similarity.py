"""Similarity transforms of scenes with their cameras and lights, which leave the image unchanged."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...scene.geometry.scaling import SceneFrame, in_frame
from ...scene.geometry.transform import rotation, transform_camera, transform_light, transform_mesh
from ...scene.model import Camera, Environment, Scene, Sphere
from .random_draws import Draws

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Similarity:
    """Optional mirroring in x = 0, rotation by `turn` (scene.transform.rotation), translation and scale to `frame`."""

    mirrored: bool
    turn: tuple[float, float, float]
    frame: SceneFrame

    @property
    def linear(self) -> Matrix:
        """Linear part, without the frame, (4, 4)."""
        return rotation(self.turn) @ np.diag([-1.0 if self.mirrored else 1.0, 1.0, 1.0, 1.0])

    def of(self, scene: Scene) -> Scene:
        """Return the transformed scene; its image is mirrored if `mirrored`."""
        linear = self.linear
        turned = replace(
            scene,
            meshes=[transform_mesh(mesh, linear) for mesh in scene.meshes],
            instances=[replace(each, to_world=linear[:3, :3] @ each.to_world) for each in scene.instances],
            spheres=[_turned(sphere, linear) for sphere in scene.spheres],
            lights=[transform_light(light, linear) for light in scene.lights],
            environment=self._environment(scene.environment),
            camera=transform_camera(_mirrored(scene.camera) if self.mirrored else scene.camera, linear),
        )
        return in_frame(turned, self.frame)

    def _environment(self, environment: Environment) -> Environment:
        if environment.image is None:
            return environment
        image, degrees = environment.image, environment.rotation_degrees
        if self.mirrored:
            image, degrees = np.ascontiguousarray(image[:, ::-1]), -degrees
        return replace(environment, image=image, rotation_degrees=degrees + self.turn[1])


def _mirrored(camera: Camera) -> Camera:
    """Return the camera whose image is mirrored."""
    across, along = camera.lens_shift
    distortion = list(camera.distortion)
    if camera.projection == "perspective" and distortion:
        distortion[3] *= -1  # p2
    return replace(camera, lens_shift=(-across, along), skew=-camera.skew, distortion=tuple(distortion))


def random_similarity(scene: Scene, draws: Draws) -> Similarity:
    """Return one that preserves the image: environment maps rotate about +Y only, textured spheres not at all."""
    fixed = any(sphere.material.textures() for sphere in scene.spheres)
    mirrored, turn = draws.chance(0.5), draws.vector(-180.0, 180.0)
    if fixed:
        mirrored, turn = False, (0.0, 0.0, 0.0)
    elif scene.environment.image is not None:
        turn = (0.0, turn[1], 0.0)
    return Similarity(mirrored, turn, SceneFrame(draws.vector(-20.0, 20.0), draws.decades(-2.0, 2.0)))


def _turned(sphere: Sphere, linear: Matrix) -> Sphere:
    x, y, z = (linear[:3, :3] @ sphere.center).tolist()
    return replace(sphere, center=(x, y, z))
