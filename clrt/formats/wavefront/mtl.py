"""Materials of Wavefront MTL libraries, including the common extension for physically based rendering (PBR).

The format: "MTL material format", Wavefront, 1995; PBR keys: Exocortex and Blinn, "Extending OBJ/MTL", as in tinyobj.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Set
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...errors import SceneError
from ...file_names import printable
from ...scene.materials.material_types import Dielectric, Diffuse, Material, MetallicRoughness, Mirror
from ...scene.materials.textures import Texture
from .mtl_maps import Kind, Maps, strength

#: Illumination models with mirror reflection, and with refraction.
MIRRORS, GLASS = {3, 5, 8}, {4, 6, 7, 9}
#: Below this a diffuse color counts as black, and a material with a mirror illumination model becomes a Mirror.
BLACK = 0.05
#: Keys of unsupported layers and effects.
OTHERS = {"ps": "sheen (Ps)", "pc": "clearcoat (Pc)", "aniso": "anisotropy (aniso)"}
#: Supported maps.
MAPS: dict[str, Kind] = {
    "map_kd": "color",
    "map_ke": "color",
    "map_d": "opacity",
    "map_pr": "number",
    "map_pm": "number",
}
#: Maps of normals, and those of heights, in which exporters also store normals.
NORMALS, BUMPS = ("norm", "map_kn", "map_norm", "map_normal"), ("map_bump", "bump")
KEYS = {"kd", "ks", "ke", "ns", "ni", "tf", "tr", "d", "illum", "pr", "pm", *OTHERS}
#: A comment; a # within a file name does not begin one.
COMMENT = re.compile(r"\s#.*")


@dataclass
class MtlMaterial:
    """One newmtl of a library: its `numbers` by key, such as "kd", and the rest of the line for each of its `maps`."""

    name: str
    numbers: dict[str, list[float]] = field(default_factory=dict)
    maps: dict[str, str] = field(default_factory=dict)

    def number(self, key: str, missing: float) -> float:
        return self.numbers[key][0] if key in self.numbers else missing

    def color(self, key: str, missing: float, most: float = 1.0) -> tuple[float, float, float]:
        """Return three numbers clamped to 0 … `most`; a single one stands for all three."""
        values = self.numbers.get(key, [missing])
        red, green, blue = (min(max(value, 0.0), most) for value in (values * 3)[:3])
        return red, green, blue

    @property
    def illumination(self) -> int:
        return int(self.number("illum", 2))

    @property
    def is_glass(self) -> bool:
        """Whether light is refracted. Maya writes illum 4 and Ni 1 for all, Blender illum 9 and d for transparency."""
        blended = self.illumination == 9 and self.number("d", 1.0) < 1 and "tf" not in self.numbers
        return self.illumination in GLASS and self.number("ni", 1.5) != 1 and not blended

    @property
    def opacity(self) -> float:
        """Return d, or else 1 − Tr, or Maya's Tf; but Tr 1, written by programs that take it for d, is opaque."""
        if "d" in self.numbers:
            return self.color("d", 1.0)[0]
        if self.illumination in GLASS and not self.is_glass and "tf" in self.numbers and "tr" not in self.numbers:
            return sum(self.color("tf", 1.0)) / 3
        return 1.0 - self.color("tr", 0.0)[0] or 1.0


def read_library(text: str) -> dict[str, MtlMaterial]:
    """Return the entries of a library by name. Raises SceneError if a value is not a number."""
    entries: dict[str, MtlMaterial] = {}
    entry = MtlMaterial("")
    tr = "d" if "meshlab" in text[:500].lower() else "tr"
    for line in text.split("\n"):
        key, rest = (line.split(None, 1) + ["", ""])[:2]
        key = key.lower()
        if key == "newmtl":
            name = printable(" ".join(rest.split()))  # names may contain #
            entry = entries.setdefault(name, MtlMaterial(name))
        elif key.startswith(("map_", "bump", "disp", "decal", "refl", "norm")):
            entry.maps[key] = COMMENT.sub("", rest).strip()
        elif key in KEYS and (rest := rest.split("#")[0].strip()):
            entry.numbers[tr if key == "tr" else key] = _numbers(entry, key, rest)
    return entries


def _numbers(entry: MtlMaterial, key: str, rest: str) -> list[float]:
    words = [word for word in rest.split() if word != "-halo"]
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    wanted = (1, 3) if key in ("kd", "ks", "ke", "tf") else (1, 2, 3)
    if len(numbers) not in wanted or not all(map(math.isfinite, numbers)):
        raise SceneError(
            f'material "{entry.name}": {key.capitalize()} is "{rest[:60]}"; write '
            f"{'three numbers' if len(wanted) == 2 else 'a number'} in the material library"
        )
    return numbers


def material(entry: MtlMaterial, maps: Maps) -> Material:
    """Convert an entry to a material.

    With Pr or Pm it is metallic_roughness; otherwise `illum` selects glass, a mirror, metallic_roughness or diffuse.
    The roughness follows from the exponent Ns such that GGX is as wide as Blinn's lobe: alpha² = 2/(Ns + 2) (Walter et
    al. 2007). Maps multiply the colors and numbers that they belong to, or 1 if these are missing.
    """
    found = {
        key: texture for key, words in entry.maps.items() if key in MAPS and (texture := maps.texture(words, MAPS[key]))
    }
    shared: dict[str, Any] = {"emission": _painted(found.get("map_ke"), entry, "ke", 0.0, math.inf)}
    if (normals := _normal_map(entry, maps)) is not None:
        shared["normal_map"] = normals
    roughness = (2 / (2 + max(entry.number("ns", 0.0), 0.0))) ** 0.25
    if entry.is_glass and not {"pr", "pm"} & entry.numbers.keys():
        ior = float(np.clip(entry.number("ni", 1.5), 0.25, 4.0))
        return Dielectric(color=entry.color("tf", 1.0), ior=ior, **shared)
    shared["opacity"] = _numbered(found.get("map_d"), entry.opacity)
    color, specular = _painted(found.get("map_kd"), entry, "kd", 0.8), entry.color("ks", 0.0)
    if {"pr", "pm"} & entry.numbers.keys() or {"map_pr", "map_pm"} & found.keys():
        rough = entry.color("pr", 1.0 if "map_pr" in found else roughness)[0]
        metal = entry.color("pm", 1.0 if "map_pm" in found else 0.0)[0]
        return MetallicRoughness(
            color=color,
            metallic=_numbered(found.get("map_pm"), metal),
            roughness=_numbered(found.get("map_pr"), rough),
            **shared,
        )
    black = not isinstance(color, Texture) and max(color) < BLACK
    if entry.illumination in MIRRORS and black and max(specular) > BLACK:
        return Mirror(color=specular, **shared)
    if entry.illumination >= 2 and max(specular) > 0:
        return MetallicRoughness(color=color, roughness=roughness, **shared)
    return Diffuse(color=color, **shared)


def _painted(
    texture: Texture | None, entry: MtlMaterial, key: str, missing: float, most: float = 1.0
) -> tuple[float, float, float] | Texture:
    """Return a color, or its map with the color as factor."""
    return entry.color(key, missing, most) if texture is None else replace(texture, factor=entry.color(key, 1.0, most))


def _numbered(texture: Texture | None, number: float) -> float | Texture:
    return number if texture is None else replace(texture, factor=number)


def _normal_map(entry: MtlMaterial, maps: Maps) -> Texture | None:
    """Return the normal map, which may be where heights belong; maps of heights are ignored."""
    for key in NORMALS + BUMPS:
        if key in entry.maps:
            words = entry.maps[key]
            texture = maps.texture(words) if key in NORMALS else maps.bump(words)
            if texture is not None:
                return replace(texture, factor=strength(words))
            maps.ignored |= {key} & set(BUMPS)
    return None


def left_out(entries: Mapping[str, MtlMaterial], ignored: Set[str]) -> list[str]:
    """Return descriptions of what the entries have that `material` ignores. ignored: the bump maps."""
    maps = sorted({key for entry in entries.values() for key in entry.maps} - {*MAPS, *NORMALS, *BUMPS} | ignored)
    numbers = {key for entry in entries.values() for key in entry.numbers}
    return [f"textures ({', '.join(maps)})"] * bool(maps) + [words for key, words in OTHERS.items() if key in numbers]
