"""Small random scenes that the oracle supports: some objects on a floor below a few lights.

Emitters are large and lobes wide, since the oracle finds emitters by chance. The content of a scene is the same for
all of a batch (see Draws); positions and strengths differ.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from datetime import date
from math import cos, pi, sin
from typing import Any, get_args

import numpy as np

from clrt.scene.cameras import Projection
from clrt.scene.geometry.transform import rotation, scaling, transform_mesh, translation
from clrt.scene.lights import DirectionalLight, GoniometricLight, Light, PointLight, ProjectorLight, SpotLight
from clrt.scene.materials.material_types import Diffuse, Material
from clrt.scene.model import Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere, Vector

from ..scene.shapes import icosphere
from .draws import DRAWERS, Draws, random_material
from .vectors import Doubles

#: Scenes per batch, which share programs.
BATCH = 4
#: Image size in pixels.
SIZE = (12, 8)
SHAPES = ("sphere", "solid", "sheet", "instances")
EMITTERS = ("sphere", "solid", "sheet", "instances")
#: Lights that the oracle finds by chance, then those that it sums.
LIGHTS = (*EMITTERS, "disc", "point", "spot", "projector", "goniometric", "directional")
SKIES = (None, "constant", "image")
#: Positions around the middle of the floor.
PLACES = ((-1.0, 0.0), (0.9, 0.4), (-0.1, -1.1), (0.1, 1.2))


def todays_seed() -> int:
    """Return the date as a number, such as 20251231."""
    return int(f"{date.today():%Y%m%d}")


def random_scene(seed: int, number: int) -> Scene:
    """Return scene `number` of a seed."""
    return _Stage(Draws(seed, number // BATCH, number)).scene(f"oracle-{seed}-{number}")


@dataclass
class _Stage:
    """Scene under construction."""

    draws: Draws
    meshes: list[Mesh] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)
    spheres: list[Sphere] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)

    def scene(self, name: str) -> Scene:
        draws = self.draws
        kinds = [draws.one_of(DRAWERS), draws.one_of(DRAWERS), Diffuse]
        self._sheet(
            random_material(draws, draws.one_of(kinds), opaque=True),
            scaling((3, 1, 3)),
            translation((0, draws.between(-0.1, 0.1), 0)),
        )
        for x, z in PLACES[: draws.one_of((2, 3, 4))]:
            size = draws.between(0.4, 0.8)
            middle = x + draws.between(-0.3, 0.3), draws.between(0.7, 1.5) * size, z + draws.between(-0.3, 0.3)
            upright = rotation((90.0, draws.between(-180, 180), 0.0))
            self._add(draws.one_of(SHAPES), random_material(draws, draws.one_of(kinds)), middle, size, upright)
        for _ in range(draws.one_of((1, 2, 3))):
            self._add_light(draws.one_of(LIGHTS), kinds)
        settings = RenderSettings(size=SIZE, max_depth=draws.one_of((2, 4, 6)))
        return Scene(
            meshes=self.meshes,
            instances=self.instances,
            spheres=self.spheres,
            lights=[*self.lights],
            environment=self._environment(draws.one_of(SKIES)),
            camera=self._camera(),
            render=settings,
            name=name,
        )

    def _add_light(self, kind: str, kinds: list[type[Material]]) -> None:
        """Add a light above the objects; a flat one faces down."""
        draws = self.draws
        x, y, z = draws.between(-1.5, 1.5), draws.between(2.2, 3.2), draws.between(-1.5, 1.5)
        direction = draws.between(-0.8, 0.8) - x, -y, draws.between(-0.8, 0.8) - z
        red, green, blue = draws.vector(0.3, 1.0)
        if kind in EMITTERS:
            strength = draws.between(3.0, 8.0)
            emission = strength * red, strength * green, strength * blue
            material = replace(
                random_material(draws, draws.one_of(kinds), opaque=draws.chance(0.7)),
                emission=draws.texture(emission) if draws.chance(0.3) else emission,
            )
            self._add(kind, material, (x, y, z), draws.between(0.6, 0.9), rotation((180.0, 0.0, 0.0)))
        elif kind in ("disc", "directional"):
            strength = draws.between(1.0, 3.0)
            self.lights.append(
                DirectionalLight(
                    direction=direction,
                    irradiance=(strength * red, strength * green, strength * blue),
                    angle_degrees=draws.between(20, 120) if kind == "disc" else 0.0,
                )
            )
        else:
            strength, reach = draws.between(5.0, 20.0), draws.between(3.0, 8.0) if draws.chance(0.3) else None
            intensity = strength * red, strength * green, strength * blue
            if kind == "point":
                self.lights.append(PointLight(position=(x, y, z), intensity=intensity, range=reach))
                return
            up = draws.between(-0.5, 0.5), 1.0, draws.between(-0.5, 0.5)
            given: Any = dict(
                position=(x, y, z),
                direction=direction,
                intensity=intensity,
                range=reach,
                up=up,
                image=draws.light_image(),
            )
            if kind == "projector":
                given |= {"image_of": draws.one_of(("irradiance", "intensity")), "fov_degrees": draws.between(30, 80)}
                self.lights.append(ProjectorLight(**given))
                return
            if kind == "goniometric":
                self.lights.append(GoniometricLight(**given))
                return
            outer = draws.between(20, 60)
            self.lights.append(
                SpotLight(
                    **given,
                    inner_degrees=draws.between(0.0, 0.9) * outer,
                    outer_degrees=outer,
                    falloff=draws.one_of(("cosine", "angle")),
                )
            )

    def _add(self, shape: str, material: Material, middle: Vector, size: float, turn: Doubles) -> None:
        """Add an object; turn: the rotation of a flat one before a small random tilt."""
        draws = self.draws
        if shape == "sphere":
            self.spheres.append(Sphere(center=middle, radius=size, material=material))
            return
        placed = [scaling((size, size, size)), turn, rotation(draws.vector(-25, 25)), translation(middle)]
        if shape == "sheet":
            self._sheet(material, *placed)
            return
        vertices, faces = icosphere(0)
        # Shading of gloss around bent normals is not standardized: only Lambertian meshes have them.
        normals = vertices.copy() if type(material) is Diffuse and draws.chance(0.5) else None
        solid = self._finished(Mesh(vertices, faces, normals=normals), material)
        if shape == "solid":
            self.meshes.append(transform_mesh(solid, _product(*placed)))
            return
        other = random_material(draws, draws.one_of(DRAWERS)) if normals is None and draws.chance(0.3) else None
        mirrored = [scaling((0.7, 0.5, -0.6)), *placed, translation((0.0, 0.5 + size, 0.0))]
        self.instances += [
            Instance(solid, _product(scaling((0.8, 1.0, 0.6)), *placed)),
            Instance(solid, _product(*mirrored), other),
        ]

    def _sheet(self, material: Material, *placed: Doubles) -> None:
        """Add a square that faces up, two units wide."""
        corners = np.array([(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)], np.float32)
        mesh = self._finished(Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32)), material)
        self.meshes.append(transform_mesh(mesh, _product(*placed)))

    def _finished(self, mesh: Mesh, material: Material) -> Mesh:
        """Return the mesh with texture coordinates, possibly colors, a third of them with alpha, and the material."""
        draws, flat = self.draws, mesh.vertices[:, [0, 2]] + mesh.vertices[:, [1, 1]] * np.float32(0.7)
        uv, uv1 = flat * np.float32(draws.between(0.5, 2)), flat[:, ::-1] * np.float32(draws.between(0.5, 2))
        colors = None
        if draws.chance(0.2):
            channels = draws.one_of(([0, 2, 0], [0, 2, 0], [0, 2, 0, 2]))
            colors = np.abs(np.cos(draws.between(0.2, 1.5) * mesh.vertices[:, channels])).astype(np.float32)
        uv, uv1 = np.ascontiguousarray(uv), np.ascontiguousarray(uv1)
        return replace(mesh, material=material, uv=uv, uv1=uv1, colors=colors)

    def _environment(self, kind: str | None) -> Environment:
        draws = self.draws
        if kind is None:
            return Environment()
        if kind == "constant":
            return Environment(color=draws.vector(0.1, 1.0), strength=draws.between(0.1, 1.0))
        image = np.array([draws.vector(0.1, 1.0) for _ in range(32)], np.float32).reshape(4, 8, 3)
        return Environment(image=image, strength=draws.between(0.1, 1.0), rotation_degrees=draws.between(-180, 180))

    def _camera(self) -> Camera:
        draws = self.draws
        projection: Projection = draws.one_of(("perspective", "perspective", "perspective", *get_args(Projection)))
        far = draws.between(1.4, 2.2) if projection == "equirectangular" else draws.between(4.0, 6.0)
        turn, elevation = draws.between(-pi, pi), draws.between(0.25, 1.0)
        x, y, z = far * sin(turn) * cos(elevation), far * sin(elevation), far * cos(turn) * cos(elevation)
        lens, flat = projection == "perspective" and draws.chance(0.25), projection == "orthographic"
        return Camera(
            projection=projection,
            position=(x, y, z),
            up=(0.1, 1.0, 0.0),
            look_at=(draws.between(-0.4, 0.4), 0.5, draws.between(-0.4, 0.4)),
            fov_degrees=draws.between(30, 55),
            aperture_radius=draws.between(0.02, 0.3) if lens else 0.0,
            focus_distance=draws.between(3.0, 6.0) if lens and draws.chance(0.5) else None,
            view_height=draws.between(3.0, 5.0) if flat and draws.chance(0.5) else None,
            fisheye_degrees=90.0 if projection == "fisheye" else 180.0,
        )


def _product(*matrices: Doubles) -> Doubles:
    """Return the product of transforms, the first of which acts first."""
    result = np.eye(4)
    for matrix in matrices:
        result = matrix @ result
    return result
