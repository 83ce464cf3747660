"""Packing of lights: records by type, numbered type by type, and the data for choosing one of them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....scene.lights import DirectionalLight, Light, PointLight, SpotLight
from ....scene.materials.textures import Texture
from ....scene.model import Scene
from ..materials.pack_textures import PackedTextures
from ..records import DIRECTIONAL_LIGHT, POINT_LIGHT, SPHERE_LIGHT, SPOT_LIGHT, SUN_LIGHT
from .environment_map import LUMINANCE, EnvironmentMap
from .hidden_lights import hidden_lights, opaque_and_sides
from .light_bounds import Doubles, joined, round_lights, spot_lights
from .light_sampler import LightSampler, pack_choice
from .triangle_lights import pack_triangle_lights

#: Light types in the order of their numbers, infinite ones last; the kernel file is light/<name>.cl, except for the
#: sky, whose file pack_sky chooses.
TYPES = ("triangle", "sphere", "point", "spot", "directional", "sun", "sky")
SURFACES = ("triangle", "sphere")
#: Directional lights of a smaller angle are delta lights: float32 has too few directions inside their disc.
SMALLEST_DEGREES = 1e-4
#: Minimum width of a spot's falloff in the cosine, and minimum square of a range: the inverse must fit in float32.
STEEPEST = 1e-30


@dataclass(frozen=True)
class PackedLights:
    """Packed lights. buffers: name → (C type, records). counts: lights by type. triangle, sphere: light of each, or −1.
    """

    buffers: dict[str, tuple[str, NDArray[Any]]]
    counts: dict[str, int]
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


def pack_emitters(scene: Scene, sky: EnvironmentMap, textures: PackedTextures) -> PackedLights:
    """Pack all lights of the scene that are not black."""
    flat = pack_triangle_lights(scene.meshes, textures)
    balls, points, spots = _sphere_lights(scene, textures), _point_lights(scene), _spot_lights(scene)
    of_sphere = np.full(len(scene.spheres), -1, np.int32)
    of_sphere[balls["sphere"]] = len(flat.records) + np.arange(len(balls))
    beams, suns = _directional_lights(scene), _suns(scene)
    records = {"triangle": flat.records, "sphere": balls, "point": points, "spot": spots, "directional": beams,
               "sun": suns}
    counts = {kind: len(array) for kind, array in records.items() if len(array)}
    infinite = np.vstack([_irradiance(beams, np.zeros(len(beams)), _luminance(beams, "irradiance")),
                          _irradiance_of_suns(suns)])
    if sky.irradiance is not None:
        counts["sky"], infinite = 1, np.vstack([infinite, sky.irradiance])
    radius = _doubles(balls, "radius")
    groups = joined([
        flat.groups,
        round_lights(_doubles(balls, "center"), radius, np.pi * radius**2 * _luminance(balls, "radiance")),
        round_lights(_doubles(points, "position"), np.zeros(len(points)), _luminance(points, "intensity")),
        spot_lights(_doubles(spots, "position"), _doubles(spots, "axis"), 1 - _doubles(spots, "outer"),
                    _luminance(spots, "intensity"))])
    choice = pack_choice(groups, infinite)
    buffers = {f"{kind}_lights": (f"{kind.title()}Light", records[kind]) for kind in counts if kind != "sky"}
    return PackedLights(buffers | choice.buffers, counts, flat.light, of_sphere, choice)


def light_type(light: Light) -> str | None:
    """Return the type in TYPES as which a light without a surface is packed; None if it is black."""
    if isinstance(light, DirectionalLight):
        return ("sun" if light.angle_degrees >= SMALLEST_DEGREES else "directional") if any(light.irradiance) else None
    return light.kernel if any(light.intensity) else None


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


def _point_lights(scene: Scene) -> NDArray[Any]:
    lamps = [light for light in scene.lights if isinstance(light, PointLight) and light_type(light)]
    records = np.zeros(len(lamps), POINT_LIGHT)
    for record, lamp in zip(records, lamps):
        record["position"], record["intensity"] = lamp.position, lamp.intensity
        record["per_range2"] = _per_range2(lamp)
    return records


def _spot_lights(scene: Scene) -> NDArray[Any]:
    lamps = [light for light in scene.lights if isinstance(light, SpotLight) and light_type(light)]
    records = np.zeros(len(lamps), SPOT_LIGHT)
    for record, lamp in zip(records, lamps):
        # 1 − cos x = 2 sin² (x/2), which is accurate for small angles.
        inner, outer = 2 * np.sin(np.radians([lamp.inner_degrees, lamp.outer_degrees]) / 2) ** 2
        record["position"], record["intensity"] = lamp.position, lamp.intensity
        record["axis"] = np.asarray(lamp.direction) / np.linalg.norm(lamp.direction)
        record["outer"], record["slope"] = outer, 1 / max(outer - inner, STEEPEST)
        record["per_range2"] = _per_range2(lamp)
    return records


def _per_range2(lamp: PointLight | SpotLight) -> float:
    return 0.0 if lamp.range is None else 1 / max(lamp.range**2, STEEPEST)


def _directional_lights(scene: Scene) -> NDArray[Any]:
    beams = _directional(scene, "directional")
    records = np.zeros(len(beams), DIRECTIONAL_LIGHT)
    for record, beam in zip(records, beams):
        record["towards"], record["irradiance"] = _towards(beam), beam.irradiance
    return records


def _suns(scene: Scene) -> NDArray[Any]:
    suns = _directional(scene, "sun")
    records = np.zeros(len(suns), SUN_LIGHT)
    for record, sun in zip(records, suns):
        record["towards"], record["radiance"] = _towards(sun), sun.radiance
        record["height"] = 2 * np.sin(np.radians(sun.angle_degrees) / 4) ** 2   # 1 − cos x, as for spots
    return records


def _directional(scene: Scene, kind: str) -> list[DirectionalLight]:
    return [light for light in scene.lights if isinstance(light, DirectionalLight) and light_type(light) == kind]


def _towards(light: DirectionalLight) -> Doubles:
    return np.asarray(-np.asarray(light.direction) / np.linalg.norm(light.direction))


def _irradiance_of_suns(records: NDArray[Any]) -> Doubles:
    """Return (n, 4) like `_irradiance`: an upper bound that is 0 only where the whole disc is below the horizon.

    The highest point of a disc has elevation h + a, where h is the elevation of its center and a half its angle, and
    sin(h + a) <= sin h + sin a.
    """
    height = _doubles(records, "height")
    sine2 = height * (2 - height)
    return _irradiance(records, np.sqrt(sine2), np.pi * sine2 * _luminance(records, "radiance"))


def _irradiance(records: NDArray[Any], least: Doubles, luminance: Doubles) -> Doubles:
    """Return (n, 4) for `pack_choice`: a scalar and a vector for each of n infinite lights whose irradiance at a normal
    is about luminance·(least + normal·towards)."""
    return np.asarray(np.column_stack([least, _doubles(records, "towards")]) * luminance[:, None])


def _doubles(records: NDArray[Any], name: str) -> Doubles:
    return records[name].astype(np.float64)


def _luminance(records: NDArray[Any], name: str) -> Doubles:
    return np.asarray(_doubles(records, name) @ LUMINANCE)
