"""Lights of a glTF file (Khronos, KHR_lights_punctual)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import degrees

from ...scene.geometry.transform import Matrix, unit
from ...scene.lights import DirectionalLight, Light, PointLight, SpotLight
from . import schema as gltf

#: A spot's inner cone angle is limited to this fraction of the outer; files have equal ones, against the specification.
WIDEST_INNER = 0.9999


def read_lights(document: gltf.Document, nodes: Iterable[tuple[gltf.Node, Matrix]]) -> Iterator[Light]:
    """Yield the nodes' lights in world space: at the node's position, along its −Z, independent of its scale.

    Their intensity and irradiance are the numbers of the file (see light_units.py).
    """
    sources = document.extensions.KHR_lights_punctual.lights
    for node, matrix in nodes:
        if (used := node.extensions.KHR_lights_punctual) is None:
            continue
        source = gltf.entry(sources, used.light, "light", "a node")
        x, y, z = matrix[:3, 3].tolist()
        to_x, to_y, to_z = unit(-matrix[:3, 2]).tolist()
        red, green, blue = (source.intensity * part for part in source.color)
        reach = source.range if source.range is not None and source.range > 0 else None
        if source.type == "point":
            yield PointLight(position=(x, y, z), intensity=(red, green, blue), range=reach)
        elif not (to_x or to_y or to_z):
            continue  # scale 0 leaves no direction
        elif source.type == "directional":
            yield DirectionalLight(direction=(to_x, to_y, to_z), irradiance=(red, green, blue))
        else:
            outer = min(degrees(source.spot.outerConeAngle), 90.0)
            yield SpotLight(
                position=(x, y, z),
                direction=(to_x, to_y, to_z),
                intensity=(red, green, blue),
                inner_degrees=min(degrees(source.spot.innerConeAngle), WIDEST_INNER * outer),
                outer_degrees=outer,
                range=reach,
            )
