"""Packs the lights: a record of each by type, and one table from which the kernels choose.

A light's probability is the mean of two shares: its power among all power, and an equal share for each source (a
mesh, a sphere, a light, the sky), split by power inside a mesh. The first is best where all lights matter to the
whole scene, the second keeps a dim lamp in sight of a sky over a huge ground.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..scene.lights import PointLight
from ..scene.model import Scene
from .alias import alias_table
from .environment import LUMINANCE, Sky
from .records import DIRECTIONAL_LIGHT, LIGHT, POINT_LIGHT, SPHERE_LIGHT, TRIANGLE_LIGHT

#: Order of the types in a light's code; the kernel file is light/<name>.cl, the sky's is chosen by pack_sky.
TYPES = ("triangle", "sphere", "point", "directional", "sky")
SURFACES = ("triangle", "sphere")


@dataclass
class Emitters:
    """buffers: name → (C type, records). types: those in use. triangle, sphere: each one's entry in the table or −1."""

    buffers: dict[str, tuple[str, NDArray[Any]]]
    types: list[str]
    triangle: NDArray[np.int32]
    sphere: NDArray[np.int32]
    sky_probability: float
    count: int


@dataclass
class _Table:
    powers: list[NDArray[np.float64]] = field(default_factory=list)
    codes: list[NDArray[np.int32]] = field(default_factory=list)
    records: dict[str, list[NDArray[Any]]] = field(default_factory=dict)
    size: int = 0

    def add(self, kind: str, power: NDArray[np.float64], records: NDArray[Any] | None) -> NDArray[np.int32]:
        """Adds one source; returns the table entries of its parts."""
        stored = self.records.setdefault(kind, [])
        first = sum(map(len, stored))
        if records is not None:
            stored.append(records)
        self.powers.append(power)
        self.codes.append((TYPES.index(kind) | (first + np.arange(len(power))) << 4).astype(np.int32))
        self.size += len(power)
        return np.arange(self.size - len(power), self.size, dtype=np.int32)


def pack_emitters(scene: Scene, triangles: NDArray[np.float32], sky: Sky, scene_radius: float) -> Emitters:
    """All lights of the scene. triangles: (m, 3, 3) float32, the meshes' in order; scene_radius: half its diagonal."""
    table = _Table()
    of_triangle = np.full(len(triangles), -1, np.int32)
    of_sphere = np.full(len(scene.spheres), -1, np.int32)
    first = 0
    for mesh in scene.meshes:
        last = first + len(mesh.faces)
        if any(mesh.material.emission):
            records, power = _triangle_lights(triangles[first:last].astype(np.float64), mesh.material.emission)
            of_triangle[first:last] = table.add("triangle", power, records)
        first = last
    for i, sphere in enumerate(scene.spheres):
        if any(sphere.material.emission):
            lamp = np.zeros(1, SPHERE_LIGHT)
            lamp["center"], lamp["radius"], lamp["radiance"] = sphere.center, sphere.radius, sphere.material.emission
            area = 4 * np.pi * sphere.radius**2
            power = np.pi * area * LUMINANCE @ sphere.material.emission
            of_sphere[i] = table.add("sphere", np.array([power]), lamp)[0]
    disc = np.pi * scene_radius**2
    for light in scene.lights:
        if isinstance(light, PointLight):
            point = np.zeros(1, POINT_LIGHT)
            point["position"], point["intensity"] = light.position, light.intensity
            table.add("point", np.array([4 * np.pi * LUMINANCE @ light.intensity]), point)
        else:
            beam = np.zeros(1, DIRECTIONAL_LIGHT)
            beam["towards"] = -np.asarray(light.direction) / np.linalg.norm(light.direction)
            beam["irradiance"] = light.irradiance
            table.add("directional", np.array([disc * LUMINANCE @ light.irradiance]), beam)
    if sky.sampled:
        table.add("sky", np.array([disc * sky.power]), None)
    return _finish(table, of_triangle, of_sphere)


def _triangle_lights(corners: NDArray[np.float64],
                     emission: tuple[float, float, float]) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """Records of emissive triangles with corners (k, 3, 3), and their powers (k,)."""
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    cross = np.cross(e1, e2)
    norm = np.linalg.norm(cross, axis=1)
    records = np.zeros(len(corners), TRIANGLE_LIGHT)
    records["p0"], records["e1"], records["e2"], records["area"] = corners[:, 0], e1, e2, norm / 2
    records["normal"] = cross / np.where(norm > 0, norm, 1)[:, None]
    records["radiance"] = emission
    return records, np.pi * norm / 2 * (LUMINANCE @ np.asarray(emission))


def _finish(table: _Table, of_triangle: NDArray[np.int32], of_sphere: NDArray[np.int32]) -> Emitters:
    total = sum(power.sum() for power in table.powers)
    if total <= 0:
        return Emitters({}, [], of_triangle * 0 - 1, of_sphere * 0 - 1, 0.0, 0)
    bright = [power for power in table.powers if power.sum() > 0]
    weights = np.concatenate([power / total + power / (power.sum() or 1) / len(bright) for power in table.powers])
    lights = np.zeros(table.size, LIGHT)
    lights["threshold"], lights["alias"], lights["probability"] = alias_table(weights)
    lights["code"] = np.concatenate(table.codes)
    buffers: dict[str, tuple[str, NDArray[Any]]] = {"lights": ("Light", lights)}
    for kind, parts in table.records.items():
        if parts:
            buffers[f"{kind}_lights"] = (f"{kind.title()}Light", np.concatenate(parts))
    types = [kind for kind in TYPES if kind in table.records]
    return Emitters(buffers, types, of_triangle, of_sphere, float(lights["probability"][-1]) if "sky" in types else 0.0,
                    table.size)
