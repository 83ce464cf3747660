"""Lights of a USD stage (UsdLux). Their radiance is the number of the file, as that of emissive materials."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from math import pi, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError
from ...file_names import printable
from ...scene.geometry.transform import Matrix, transform_mesh, unit
from ...scene.lights import DirectionalLight, Light, PointLight, SpotLight, Vector
from ...scene.materials.material_types import Diffuse
from ...scene.materials.textures import Picture, Texture
from ...scene.model import Environment, Mesh
from ..images.image_reader import linear_from_srgb, read_picture
from ..images.turned_environment import interpolated, resampled, turned_about_y
from .materials import Materials
from .solids import SEGMENTS, solid

log = logging.getLogger(__name__)
#: Angles of cones from which a light is not a spot, and largest part of the angle that may be inside of its falloff.
WIDEST = 90.0
WIDEST_INNER = 0.9999


@dataclass
class Lights:
    """Lights of a model; `ignored`: what of them is not rendered."""

    lights: list[Light] = field(default_factory=list)
    emitters: list[Mesh] = field(default_factory=list)
    environment: Environment | None = None
    ignored: list[str] = field(default_factory=list)


def read_lights(path: Path, facts: list[dict[str, Any]], materials: Materials, upright: Matrix) -> Lights:
    """Return the lights in the scene's axes and meters. upright: from the stage's."""
    found = Lights()
    for light in facts:
        color = np.nan_to_num(np.maximum(light["color"], 0.0), posinf=0.0)
        matrix = upright @ np.array(light["matrix"])
        if light["type"] == "DomeLight":
            if found.environment is not None:
                found.ignored.append("a second dome light")
            else:
                found.environment = _dome(path, light, color, matrix, materials)
        elif light["type"] == "DistantLight":
            if (distant := _distant(light, color, matrix)) is not None:
                found.lights.append(distant)
        else:
            if light["normalize"]:  # areas are in the stage's unit
                color = color * np.linalg.norm(upright[:3, 0]) ** 2
            _add_local(found, light, color, matrix, materials)
    return found


def _distant(light: dict[str, Any], color: NDArray[np.float64], matrix: Matrix) -> DirectionalLight | None:
    """Return a light along −Z. Its irradiance is the intensity if that is normalized, or if the angle is 0."""
    angle = min(max(float(light["angle"]), 0.0), 180.0)
    projected = 1.0 if light["normalize"] or angle == 0 else pi * sin(radians(angle) / 2) ** 2
    to_x, to_y, to_z = unit(-matrix[:3, 2]).tolist()
    if not (to_x or to_y or to_z):
        return None
    return DirectionalLight(direction=(to_x, to_y, to_z), irradiance=_rgb(color * projected), angle_degrees=angle)


def _add_local(
    found: Lights, light: dict[str, Any], color: NDArray[np.float64], matrix: Matrix, materials: Materials
) -> None:
    """Add a light with a place: as a point or a spot if it is one, else as an emissive mesh."""
    name = printable(light["name"])
    spot = light.get("cone") is not None and light["cone"] < WIDEST
    if light["type"] == "SphereLight" and (spot or light["point"] or light["radius"] <= 0):
        if (point := _point(light, color, matrix, spot)) is not None:
            found.lights.append(point)
        return
    if spot:
        found.ignored.append(f'the cone of light "{name}"')
    mesh = _shape(light, name)
    if mesh is None:
        return
    placed = transform_mesh(mesh, matrix)
    radiance = color / (_area(placed) if light["normalize"] else 1.0)
    placed.material = Diffuse(color=(0.0, 0.0, 0.0), emission=_emission(light, radiance, materials))
    if np.isfinite(placed.vertices).all() and np.isfinite(radiance).all():
        found.emitters.append(placed)


def _point(light: dict[str, Any], color: NDArray[np.float64], matrix: Matrix, spot: bool) -> Light | None:
    """Return a sphere as a point: radiance times the area of its disc, in m²; of a normalized one a quarter of its
    number, as a disc has a quarter of a sphere's area."""
    scale = float(abs(np.linalg.det(matrix[:3, :3])) ** (1 / 3))
    intensity = _rgb(color / 4 if light["normalize"] else color * pi * (light["radius"] * scale) ** 2)
    x, y, z = matrix[:3, 3].tolist()
    to_x, to_y, to_z = unit(-matrix[:3, 2]).tolist()
    if not spot:
        return PointLight(position=(x, y, z), intensity=intensity)
    if not (to_x or to_y or to_z) or light["cone"] <= 0:
        return None
    outer = float(light["cone"])
    inner = outer * min(max(1 - light["softness"], 0.0), WIDEST_INNER)
    return SpotLight(
        position=(x, y, z),
        direction=(to_x, to_y, to_z),
        intensity=intensity,
        inner_degrees=inner,
        outer_degrees=outer,
    )


def _shape(light: dict[str, Any], name: str) -> Mesh | None:
    """Return a light's surface in its own frame: rectangles and discs emit along −Z; None for one without a size."""
    if light["type"] in ("SphereLight", "CylinderLight"):
        size = {"radius": light["radius"]}
        size |= {"height": light["length"], "axis": "X"} if "length" in light else {}
        made = solid(light["type"].removesuffix("Light"), size)
        return None if made is None else Mesh(made[0], made[1], name=name)
    if light["type"] == "RectLight":
        x, y = light["width"] / 2, light["height"] / 2
        vertices = np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]], np.float32)
        faces = np.array([[0, 2, 1], [0, 3, 2]], np.int32)
        uv = np.array([[1, 1], [0, 1], [0, 0], [1, 0]], np.float32)
        return Mesh(vertices, faces, name=name, uv=uv) if x > 0 and y > 0 else None
    turns = np.arange(SEGMENTS) * 2 * pi / SEGMENTS
    rim = light["radius"] * np.column_stack([np.cos(turns), np.sin(turns), np.zeros(SEGMENTS)])
    vertices = np.concatenate([np.zeros((1, 3)), rim]).astype(np.float32)
    first = np.arange(SEGMENTS)
    faces = np.column_stack([np.zeros(SEGMENTS), 1 + (first + 1) % SEGMENTS, 1 + first]).astype(np.int32)
    return Mesh(vertices, faces, name=name) if light["radius"] > 0 else None


def _area(mesh: Mesh) -> float:
    a, b, c = mesh.vertices.astype(np.float64)[mesh.faces].swapaxes(0, 1)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2) or np.inf


def _emission(light: dict[str, Any], radiance: NDArray[np.float64], materials: Materials) -> Vector | Texture:
    texels = materials.texels(light.get("texture"))
    if texels is None:
        return _rgb(radiance)
    return Texture(picture=Picture(texels, printable(light["name"])), factor=_rgb(radiance), wrap=("clamp", "clamp"))


def _dome(
    path: Path, light: dict[str, Any], color: NDArray[np.float64], matrix: Matrix, materials: Materials
) -> Environment:
    """Return the light from all around; its image is that of clrt's environments if its pole is up."""
    number = light.get("texture")
    image = None if number is None else _panorama(path, number, materials)
    if image is None:
        return Environment(color=_rgb(color))
    image = np.asarray(np.nan_to_num(image, posinf=0) * color, np.float32).clip(0, None)
    turn = unit(matrix[:3, :3].T).T  # columns are the dome's axes in the scene
    if light["pole"] == "Z":
        turn = turn[:, [1, 2, 0]]
    if (angle := turned_about_y(turn)) is not None:
        return Environment(image=image, rotation_degrees=angle)
    rows, columns = image.shape[:2]

    def lookup(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        return interpolated(image, u * columns - 0.5, v * rows - 0.5)

    return Environment(image=resampled(lookup, turn, rows))


def _panorama(path: Path, number: int, materials: Materials) -> NDArray[np.float32] | None:
    try:
        source = materials.image(number)
        if isinstance(source, Path):
            return read_picture(source)
        texels = materials.texels(number)
        return None if texels is None else linear_from_srgb((texels[..., :3] / 255).astype(np.float32))
    except SceneError as error:
        log.warning("%s: the texture of a dome light is ignored: %s", path, error)
        return None


def _rgb(values: NDArray[np.float64]) -> Vector:
    red, green, blue = values.tolist()
    return red, green, blue
