"""AOVs (arbitrary output variables): a table of their names, channels, sources and displays.

To add one: write its entry here, and the function that its source needs.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, NamedTuple

#: Source of its values. mean, center: the function seen_NAME of kernels/aov/first_hit.cl, averaged over a pixel's
#: camera rays or for the ray through its center; hits: those, on the host (clrt/rendering/accumulation/first_hits.py);
#: coverage: what each of a pixel's camera rays hits, likewise; film: the film (clrt/rendering/aovs.py).
Source = Literal["mean", "center", "hits", "coverage", "film"]
#: How a .png shows it (clrt/output/aov_files.py).
Display = Literal["light", "error", "color", "direction", "position", "depth", "count", "id", "matte"]
#: Channels of three layers, of two ids and coverages each.
CRYPTOMATTE = tuple(f"{layer:02}.{channel}" for layer in range(3) for channel in "RGBA")


#: The AOV that has a layer for each light group of a scene, and what their names begin with.
LIGHT_GROUPS, OF_GROUP = "light_groups", "light_group."


class AovType(NamedTuple):
    """Entry of the table. channels: their names, one or three, or of Cryptomatte's layers. reads: what its seen_NAME
    reads in addition to the geometry: the shading normal, with normal maps, or the BSDF."""

    channels: str | tuple[str, ...]
    source: Source
    display: Display
    reads: Literal["", "normal", "bsdf"] = ""


AOV_TYPES = {
    "albedo": AovType("RGB", "mean", "color", "bsdf"),
    "normal": AovType("XYZ", "mean", "direction", "normal"),
    "geometric_normal": AovType("XYZ", "mean", "direction"),
    "position": AovType("XYZ", "center", "position"),
    "depth": AovType("Z", "hits", "depth"),
    "primitive": AovType("X", "hits", "id"),
    "object": AovType("X", "hits", "id"),
    "material": AovType("X", "hits", "id"),
    "crypto_object": AovType(CRYPTOMATTE, "coverage", "matte"),
    "crypto_material": AovType(CRYPTOMATTE, "coverage", "matte"),
    "direct": AovType("RGB", "film", "light"),
    "indirect": AovType("RGB", "film", "light"),
    LIGHT_GROUPS: AovType("RGB", "film", "light"),
    "variance": AovType("RGB", "film", "error"),
    "samples": AovType("X", "film", "count"),
}


def aov_type(name: str) -> AovType:
    """Return the type of an AOV, or of a layer of a light group."""
    return AOV_TYPES[LIGHT_GROUPS if name.startswith(OF_GROUP) else name]


def layer_names(aovs: Iterable[str], groups: Iterable[str]) -> list[str]:
    """Return the names of the layers of AOVs: their own, or those of the light groups."""
    layers = [f"{OF_GROUP}{group}" for group in groups]
    return [layer for name in aovs for layer in (layers if name == LIGHT_GROUPS else [name])]


def channel_names(aov: str) -> list[str]:
    """Return the names of its channels in a file."""
    channels = aov_type(aov).channels
    return [f"{aov}.{channel}" if isinstance(channels, str) else f"{aov}{channel}" for channel in channels]


def aovs_from(*sources: Source) -> tuple[str, ...]:
    """Return the names of the AOVs from these sources, in the order of the table."""
    return tuple(name for name, kind in AOV_TYPES.items() if kind.source in sources)
