"""Packing of lights: records by type, numbered type by type, and the data for choosing one of them.

The types of scene.lights say themselves what their kernel files read and where they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....scene.light_images import LightImage
from ....scene.lights import Bounds, DistantBounds, Light
from ....scene.materials.textures import Texture
from ....scene.model import Scene
from ..geometry.pack_instances import PackedInstances
from ..materials.pack_textures import PackedTextures
from ..records import LIGHT_PLACEMENT, SPHERE_LIGHT, parameter_record
from .environment_map import LUMINANCE, EnvironmentMap
from .hidden_lights import hidden_lights, opaque_and_sides
from .light_bounds import Doubles, distant_lights, joined, placed_lights, round_lights
from .light_sampler import LightSampler, pack_choice
from .light_types import LIGHT_KERNELS
from .pack_light_images import PackedLightImages
from .triangle_lights import pack_triangle_lights


@dataclass(frozen=True)
class PackedLights:
    """Packed lights. buffers: name → (C type, records). counts: lights by type. features: those of the scene's lights.
    triangle, sphere: light of each, or −1."""

    buffers: dict[str, tuple[str, NDArray[Any]]]
    counts: dict[str, int]
    features: frozenset[str]
    triangle: NDArray[np.int32]
    sphere: NDArray[np.int32]
    choice: LightSampler

    @property
    def types(self) -> list[str]:
        """Light types in use, in the order of TYPES."""
        return list(self.counts)

    @property
    def count(self) -> int:
        """Number of all lights."""
        return sum(self.counts.values())


def pack_emitters(
    scene: Scene, sky: EnvironmentMap, textures: PackedTextures, placements: PackedInstances | None = None
) -> PackedLights:
    """Pack all lights of the scene that are not black; placements: see `pack_triangle_lights`."""
    flat = pack_triangle_lights(scene.meshes, textures, placements)
    balls = _sphere_lights(scene, textures)
    of_sphere = np.full(len(scene.spheres), -1, np.int32)
    of_sphere[balls["sphere"]] = len(flat.records) + np.arange(len(balls))
    lights = {kernel: own for kernel in LIGHT_KERNELS if (own := lights_of(scene, kernel))}
    images = PackedLightImages()
    records = {"triangle": flat.records, "sphere": balls}
    records |= {kernel: _records(own, images) for kernel, own in lights.items()}
    counts = {kind: len(array) for kind, array in records.items() if len(array)}
    bounds = [light.bounds() for own in lights.values() for light in own]
    infinite = distant_lights([each for each in bounds if isinstance(each, DistantBounds)])
    if sky.irradiance is not None:
        counts["sky"], infinite = 1, np.vstack([infinite, sky.irradiance])
    radius = _doubles(balls, "radius")
    groups = joined(
        [
            flat.groups,
            round_lights(_doubles(balls, "center"), radius, np.pi * radius**2 * _luminance(balls, "radiance")),
            placed_lights([each for each in bounds if isinstance(each, Bounds)]),
        ]
    )
    choice = pack_choice(groups, infinite)
    names = {kind: f"{kind.title().replace('_', '')}Light" for kind in counts if kind != "sky"}
    buffers = {f"{kind}_lights": (name, records[kind]) for kind, name in names.items()} | images.buffers()
    features = frozenset[str]().union(*(light.features() for own in lights.values() for light in own))
    if (flat.place >= 0).any():
        buffers["light_placements"] = ("LightPlacement", flat.place.view(LIGHT_PLACEMENT))
        features |= {"MOVING_LIGHTS"}
    return PackedLights(buffers | choice.buffers, counts, features, flat.light, of_sphere, choice)


def lights_of(scene: Scene, kernel: str) -> list[Light]:
    """Return the scene's lights that a kernel file samples, in the order of their records; black ones have none."""
    return [light for light in scene.lights if light.sampled_by == kernel and not light.is_black]


def _records(lights: Sequence[Light], images: PackedLightImages) -> NDArray[Any]:
    """Return the records of one or more lights that one kernel file samples, adding their images to `images`."""
    values = [
        {name: images.number(value) if isinstance(value, LightImage) else value for name, value in named.items()}
        for named in (light.parameters() for light in lights)
    ]
    records = np.zeros(len(values), parameter_record(values))
    for record, named in zip(records, values):
        for name, value in named.items():
            record[name] = value
    return records


def _sphere_lights(scene: Scene, textures: PackedTextures) -> NDArray[Any]:
    lamps = [(i, sphere) for i, sphere in enumerate(scene.spheres) if any(sphere.material.radiance)]
    opaque, sides = opaque_and_sides([sphere.material for _, sphere in lamps])
    shapes = np.array([(*sphere.center, sphere.radius) for _, sphere in lamps], np.float64).reshape(-1, 4)
    hidden = hidden_lights(np.column_stack([shapes, sides]), opaque)
    lamps = list(compress(lamps, ~hidden))
    records = np.zeros(len(lamps), SPHERE_LIGHT)
    for record, (record["sphere"], lamp) in zip(records, lamps):
        record["center"], record["radius"], record["radiance"] = lamp.center, lamp.radius, lamp.material.radiance
        emission = lamp.material.emission
        record["texture"] = textures.number(emission) if isinstance(emission, Texture) else -1
        record["double_sided"] = lamp.material.double_sided
    return records


def _doubles(records: NDArray[Any], name: str) -> Doubles:
    return records[name].astype(np.float64)


def _luminance(records: NDArray[Any], name: str) -> Doubles:
    return np.asarray(_doubles(records, name) @ LUMINANCE)
