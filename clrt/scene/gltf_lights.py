"""The lights of a glTF file (Khronos, KHR_lights_punctual).

Its photometric units are taken for ours one to one, as its renderers do: candela for W/sr, lux for W/m².
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import degrees

from . import gltf_document as gltf
from .lights import DirectionalLight, Light, PointLight, SpotLight
from .transform import Matrix, unit

#: Of its outer cone's angle the most that a spot's inner one has: files have both alike, against the specification.
WIDEST_INNER = 0.9999


def read_lights(document: gltf.Document, nodes: Iterable[tuple[gltf.Node, Matrix]]) -> Iterator[Light]:
    """Those of the nodes, in the world: where a node is, and along its −Z; its scale does not matter."""
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
            continue    # squeezed to nothing, it shines nowhere
        elif source.type == "directional":
            yield DirectionalLight(direction=(to_x, to_y, to_z), irradiance=(red, green, blue))
        else:
            outer = min(degrees(source.spot.outerConeAngle), 90.0)
            yield SpotLight(position=(x, y, z), direction=(to_x, to_y, to_z), intensity=(red, green, blue),
                            inner_degrees=min(degrees(source.spot.innerConeAngle), WIDEST_INNER * outer),
                            outer_degrees=outer, range=reach)
