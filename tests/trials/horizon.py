"""White furnace tests: energy of surfaces with interpolated normals or normal maps, compared with flat ones.

The environment has radiance 1, so a surface that reflects all light has 1 in every pixel.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import clrt
from clrt.bench.kernel_probe import Doubles
from clrt.bench.rays.hard_meshes import icosphere
from clrt.scene.materials.material import Material
from clrt.scene.materials.material_types import Diffuse, MetallicRoughness, Mirror
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import Camera, Environment, Mesh, RenderSettings, Scene

WHITE = (1.0, 1.0, 1.0)
MATERIALS: dict[str, Material] = {
    "diffuse": Diffuse(color=WHITE),
    "mirror": Mirror(color=WHITE),
    "metal .1": MetallicRoughness(color=WHITE, metallic=1.0, roughness=0.1, multiple_scattering=True),
    "metal .5": MetallicRoughness(color=WHITE, metallic=1.0, roughness=0.5, multiple_scattering=True),
    "plastic .3": MetallicRoughness(color=WHITE, roughness=0.3),
}
SETTINGS = RenderSettings(size=(160, 160), spp=64, max_depth=64)
#: Radius and height along a vase with a flared rim.
PROFILE = (
    (0.0, -1.0),
    (0.45, -1.0),
    (0.75, -0.7),
    (0.85, -0.3),
    (0.7, 0.2),
    (0.4, 0.6),
    (0.3, 0.8),
    (0.38, 0.95),
    (0.55, 1.05),
    (0.6, 1.1),
    (0.55, 1.12),
    (0.45, 1.05),
    (0.3, 0.9),
    (0.22, 0.75),
)


def sphere() -> Mesh:
    vertices, faces = icosphere(1)
    return Mesh(vertices, faces, normals=vertices.copy())


def vase(around: int = 24) -> Mesh:
    """Return a surface of revolution with area-weighted vertex normals."""
    turn = 2 * np.pi * np.arange(around) / around
    rings = [np.stack([r * np.cos(turn), np.full(around, y), r * np.sin(turn)], axis=1) for r, y in PROFILE]
    vertices = np.concatenate(rings)
    row, column = (each.ravel() for each in np.indices((len(PROFILE) - 1, around)))
    a, b = row * around + column, row * around + (column + 1) % around
    faces = np.concatenate([np.stack([a, a + around, b], axis=1), np.stack([b, a + around, b + around], axis=1)])
    p, q, r = (vertices[corner] for corner in faces.T)
    areas = np.cross(q - p, r - p)
    faces, areas = (each[np.linalg.norm(areas, axis=1) > 1e-9] for each in (faces, areas))
    normals = np.zeros_like(vertices)
    for corner in faces.T:
        np.add.at(normals, corner, areas)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)
    return Mesh(vertices.astype(np.float32), faces.astype(np.int32), normals=normals.astype(np.float32))


def dome() -> Mesh:
    """Return a square with the normal map of a hemisphere."""
    x, y = np.meshgrid(*[(np.arange(256) + 0.5) / 128 - 1] * 2)
    inside = np.hypot(x, y) < 0.95
    slope = np.stack([np.where(inside, x, 0), np.where(inside, -y, 0)], axis=-1)
    normals = np.dstack([slope, np.sqrt(1 - np.sum(slope**2, axis=-1))])
    texels = np.full((256, 256, 4), 255, np.uint8)
    texels[..., :3] = np.round((normals + 1) / 2 * 255)
    square = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], np.float32)
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    bumps = Diffuse(normal_map=Texture(picture=Picture(texels)))
    return Mesh(square, np.array([[0, 1, 2], [0, 2, 3]], np.int32), bumps, uv=uv)


SHAPES = {
    "sphere of 80 triangles": (sphere(), Camera(position=(0, 0, 5), fov_degrees=30)),
    "vase": (vase(), Camera(position=(0, 1.5, 5), fov_degrees=30)),
    "dome in a normal map": (dome(), Camera(position=(0, -2.2, 2.2), up=(0, 0, 1), fov_degrees=42)),
}


def covered(mesh: Mesh, camera: Camera, material: Material) -> Doubles:
    """Return the radiance of the pixels that the mesh covers."""

    def pixels(of: Material) -> Doubles:
        scene = Scene(
            meshes=[replace(mesh, material=of)], camera=camera, environment=Environment(color=WHITE), render=SETTINGS
        )
        return clrt.render(scene).pixels[..., 0].astype(np.float64)

    return np.asarray(pixels(material)[pixels(Diffuse(color=(0.0, 0.0, 0.0))) == 0])


def trial() -> Iterator[str]:
    yield f"{'':24}{'':12}   mean  least pixel  flat mean"
    for shape, (mesh, camera) in SHAPES.items():
        for name, material in MATERIALS.items():
            bent = covered(mesh, camera, replace(material, normal_map=mesh.material.normal_map))
            flat = covered(replace(mesh, normals=None), camera, material)
            yield f"{shape:24}{name:12}{bent.mean():7.4f}{bent.min():13.2f}{flat.mean():11.4f}"
