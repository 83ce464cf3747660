"""Random scenes that cover the registries: materials, lights, cameras, textures, with all optional fields.

Some objects and instances stand on a floor below a few lights. Scenes of a batch (see Draws) have the same kinds of
objects and lights, with different positions and intensities. Additions to MATERIALS, LIGHTS and CAMERA_TYPES, and new
fields of these, of Texture, Camera and RenderSettings, need no change here.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from math import cos, pi, sin
from typing import Any, get_args

import numpy as np

from ...scene.cameras import CAMERA_TYPES, Projection
from ...scene.geometry.transform import rotation, scaling, transform_mesh, translation
from ...scene.lights import LIGHTS, Light, SpotLight, fields_of
from ...scene.materials.material_types import MATERIALS, Diffuse, Material
from ...scene.model import Camera, Environment, FloatArray, Instance, Mesh, RenderSettings, Scene, Sphere, Vector
from ..rays.hard_meshes import icosphere
from .random_draws import Draws

#: Scenes per batch.
BATCH = 4
#: Size of the images in pixels.
SIZE = (32, 24)
SHAPES = ("ball", "solid", "sheet", "copies")
LAMPS = ("ball", "sheet", "solid")
SKIES = (None, "constant", "smooth", "uneven")
#: Rows and columns of an environment map.
SKY_SIZE = (8, 16)
#: Path depths; Russian roulette starts before the last.
DEPTHS = (2, 3, 4, 7)
BLACK = (0.0, 0.0, 0.0)
#: Positions around the center of the floor.
PLACES = ((-1.0, 0.0), (0.9, 0.4), (-0.1, -1.1), (0.1, 1.2))
#: Subdivisions of a solid, and of one with copies: smaller ones would be converted to meshes (scene.instancing).
SOLID, COPIED = 1, 6


def random_scene(seed: int, number: int, moderate: bool = False) -> Scene:
    """Return scene `number` of a seed; moderate: see Draws."""
    draws = Draws(seed, number // BATCH, number, moderate)
    return _Stage(draws).scene(f"combination-{seed}-{number}")


@dataclass
class _Stage:
    """A scene under construction."""

    draws: Draws
    meshes: list[Mesh] = field(default_factory=list)
    instances: list[Instance] = field(default_factory=list)
    spheres: list[Sphere] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)

    def scene(self, name: str) -> Scene:
        draws = self.draws
        kinds: list[type[Material]] = [draws.one_of(MATERIALS), draws.one_of(MATERIALS)]
        maybe_diffuse: list[type[Material]] = [Diffuse, *kinds]
        self._floor(draws.material(draws.one_of(maybe_diffuse), emission=BLACK))
        for place in PLACES[: draws.one_of((2, 3, 4))]:
            self._stand(draws.one_of(SHAPES), place, draws.material(draws.one_of(kinds), emission=BLACK))
        for number in range(draws.one_of((2, 3))):
            kind: Any = draws.one_of([*LIGHTS, *LAMPS])
            if isinstance(kind, str):
                material = draws.material(draws.one_of(maybe_diffuse), emission=self._emission())
                self._hang(kind, self._lamp_place(number), material)
            else:
                self.lights.append(self._light(kind))
        environment = self._environment(draws.one_of(SKIES))
        clamps = {each.name: each.default for each in fields(RenderSettings) if each.name.startswith("clamp_")}
        settings = draws.record(
            RenderSettings,
            size=SIZE,
            spp=16,
            max_depth=draws.one_of(DEPTHS),
            seed=0,
            integrator="path",
            shadows=True,
            adaptive=False,
            **clamps,
        )
        return Scene(
            meshes=self.meshes,
            instances=self.instances,
            spheres=self.spheres,
            lights=self.lights,
            environment=environment,
            camera=self._camera(),
            render=settings,
            name=name,
        )

    def _emission(self) -> Any:
        draws = self.draws
        strength = draws.decades(0.0, 1.0)
        red, green, blue = (strength * part for part in draws.vector(0.3, 1.0))
        return draws.texture((red, green, blue)) if draws.chance(0.3) else (red, green, blue)

    def _light(self, kind: type[Light]) -> Light:
        """Return a light above the objects that is directed at them."""
        draws = self.draws
        x, z = draws.between(-2, 2), draws.between(-2, 2)
        height, strength = draws.between(3.4 if draws.moderate else 2.0, 4.4), draws.decades(-0.5, 1.0)
        red, green, blue = (strength * part for part in draws.vector(0.2, 1.0))
        towards = draws.between(-0.8, 0.8) - x, -height, draws.between(-0.8, 0.8) - z
        drawn = draws.values(
            kind,
            **fields_of(
                kind,
                {
                    "position": (x, height, z),
                    "direction": towards,
                    "irradiance": (red, green, blue),
                    "intensity": (9 * red, 9 * green, 9 * blue),
                    "radius": 0.1 * height,
                    "radiance": (30 * red, 30 * green, 30 * blue),
                },
            ),
        )
        if kind is SpotLight:
            drawn["inner_degrees"] = min(drawn["inner_degrees"], 0.9 * drawn["outer_degrees"])
        return kind(**drawn)

    def _floor(self, material: Material) -> None:
        y = self.draws.between(-0.1, 0.1)
        self.meshes.append(self._sheet(material, "floor", scaling((3, 1, 3)), translation((0, y, 0))))

    def _stand(self, shape: str, place: tuple[float, float], material: Material) -> None:
        """Add an object on the floor, or partly in it."""
        draws = self.draws
        size = draws.between(0.3, 0.8)
        x, z = (at + draws.between(-0.3, 0.3) for at in place)
        middle = x, draws.between(0.7, 1.5) * size, z
        self._add(shape, material, middle, size)

    def _lamp_place(self, number: int) -> Vector:
        """Return the position of an emitter: in moderate draws, apart from other emitters and from the objects.

        Light sampling alone has infinite variance if an emitter touches a surface.
        """
        draws = self.draws
        if not draws.moderate:
            return draws.between(-1.5, 1.5), draws.between(2.2, 3.5), draws.between(-1.5, 1.5)
        turn = 2 * pi / 3 * number + draws.between(-0.2, 0.2)
        return 1.7 * cos(turn), draws.between(3.4, 4.2), 1.7 * sin(turn)

    def _hang(self, shape: str, middle: Vector, material: Material) -> None:
        """Add an emissive object; a flat one faces down."""
        self._add(shape, material, middle, self.draws.between(0.3, 0.7), (180.0, 0.0, 0.0))

    def _add(self, shape: str, material: Material, middle: Vector, size: float, upright: Vector | None = None) -> None:
        """Add an object. upright: its rotation before a small random tilt; None places a flat one on its edge."""
        draws = self.draws
        if shape == "ball":
            self.spheres.append(Sphere(center=middle, radius=size, material=material, name=f"ball {len(self.spheres)}"))
            return
        turns = rotation(upright or (90.0, draws.between(-180, 180), 0.0)), rotation(draws.vector(-25, 25))
        placed = scaling((size, size, size)), *turns, translation(middle)
        if shape == "sheet":
            self.meshes.append(self._sheet(material, f"sheet {len(self.meshes)}", *placed))
            return
        own = self._solid(material, f"solid {len(self.meshes)}", COPIED if shape == "copies" else SOLID)
        if shape == "solid":
            self.meshes.append(_moved(own, *placed))
            return
        stretch = scaling((size, 0.6 * size, -0.5 * size))
        beside = translation((middle[0], middle[1] + 0.4, middle[2]))
        flat = scaling((size, size, 0.5 * size))
        self.instances += [
            Instance(own, _product(flat, *turns, translation(middle)), name="one"),
            Instance(own, _product(stretch, *turns, beside), name="other"),
        ]

    def _sheet(self, material: Material, name: str, *placed: Any) -> Mesh:
        """Return a square with its front up, two units wide, after these transforms."""
        corners = np.array([(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)], np.float32)
        mesh = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32), name=name)
        return _moved(self._finished(mesh, material), *placed)

    def _solid(self, material: Material, name: str, subdivisions: int) -> Mesh:
        vertices, faces = icosphere(subdivisions)
        normals = vertices.copy() if self.draws.chance(0.5) else None
        return self._finished(Mesh(vertices, faces, normals=normals, name=name), material)

    def _finished(self, mesh: Mesh, material: Material) -> Mesh:
        """Add texture coordinates, sometimes vertex colors, some of them with alpha, and the material."""
        draws, flat = self.draws, mesh.vertices[:, [0, 2]] + mesh.vertices[:, [1, 1]] * np.float32(0.7)
        uv, uv1 = flat * np.float32(draws.between(0.5, 2)), flat[:, ::-1] * np.float32(draws.between(0.5, 2))
        colors: FloatArray | None = None
        if draws.chance(0.2):
            columns = draws.one_of(([0, 2, 0], [0, 2, 0, 2]))
            colors = np.abs(np.sin(draws.between(1, 3) * mesh.vertices[:, columns])).astype(np.float32)
        uv, uv1 = np.ascontiguousarray(uv), np.ascontiguousarray(uv1)
        return replace(mesh, material=material, uv=uv, uv1=uv1, colors=colors)

    def _environment(self, kind: str | None) -> Environment:
        draws = self.draws
        strength = draws.decades(-1.0, 0.3)
        color = draws.vector(0.2, 1.0)
        if kind is None:
            return Environment()
        if kind == "constant":
            return Environment(color=color, strength=strength)
        texels = draws.texels((*SKY_SIZE, 3)) / 255
        image = 0.5 + 0.5 * texels if kind == "smooth" else 4 * texels[..., :1] ** 8 * color
        degrees = draws.between(-180, 180)
        return Environment(image=image.astype(np.float32), strength=strength, rotation_degrees=degrees)

    def _camera(self) -> Camera:
        draws = self.draws
        projection = draws.one_of(("perspective", "perspective", "perspective", *get_args(Projection)))
        far = draws.between(1.4, 2.2) if CAMERA_TYPES[projection].all_around else draws.between(4.0, 6.0)
        turn, elevation = draws.between(-pi, pi), draws.between(0.25, 1.0)
        x, y, z = far * sin(turn) * cos(elevation), far * sin(elevation), far * cos(turn) * cos(elevation)
        lens = projection == "perspective" and draws.chance(0.25)
        radius, focus = draws.between(0.02, 0.15), draws.between(3.0, 6.0)
        given = dict(
            projection=projection,
            position=(x, y, z),
            look_at=(draws.between(-0.4, 0.4), 0.5, draws.between(-0.4, 0.4)),
            up=(0.1, 1.0, 0.0),
            fov_degrees=draws.between(30, 55),
            aperture_radius=radius if lens else 0.0,
            focus_distance=focus if lens else None,
            view_height=None,
            distortion=self._distortion() if projection == "perspective" else (),
            shutter=(0.0, 0.0),
            rolling_shutter=0.0,
            end=None,
        )
        return draws.record(Camera, **Camera(projection=projection).unread_fields() | given)

    def _distortion(self) -> tuple[float, ...]:
        """Return none, or OpenCV's first four coefficients."""
        draws = self.draws
        given = draws.chance(0.25)
        k1, k2, p1, p2 = (draws.between(-limit, limit) for limit in (0.2, 0.1, 0.01, 0.01))
        return (k1, k2, p1, p2) if given else ()


def _product(*matrices: Any) -> Any:
    """Return the product of transforms, the first of which is applied first."""
    result = np.eye(4)
    for matrix in matrices:
        result = matrix @ result
    return result


def _moved(mesh: Mesh, *matrices: Any) -> Mesh:
    return transform_mesh(mesh, _product(*matrices))
