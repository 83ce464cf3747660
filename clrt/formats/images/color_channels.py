"""Choice of the color channels of an image with several layers or parts, by their names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ...file_names import printable

#: Names of the layer that has the image itself, beside others such as "diffuse" or "albedo".
BEAUTY = ("", "rgba", "rgb", "beauty", "combined", "color", "colour", "image", "left")

LUMINANCE_CHROMA = "contains luminance and chroma, the channels Y, RY and BY; save it as R, G and B"


class ColorChannels(NamedTuple):
    """Channels of a part of an image: red, green and blue, or the grey one alone; alpha, if there is any."""

    part: int
    colors: list[int]
    alpha: list[int]


class NoColorError(ValueError):
    """The image has no color channels, or several that might be meant; the message says which it has."""


def color_channels(parts: Sequence[tuple[str, Sequence[str]]]) -> ColorChannels:
    """Return the color channels of an image, given each part's name and the names of its channels.

    Channels R, G and B, or Y alone, in a layer whose name precedes them as in "diffuse.R", or the part's name. One of
    BEAUTY is preferred. Raises NoColorError.
    """
    found: dict[str, ColorChannels] = {}
    for number, (part, names) in enumerate(parts):
        layers: dict[str, dict[str, int]] = {}
        for index, name in enumerate(names):
            layer, _, channel = name.rpartition(".")
            layers.setdefault(layer or (part if len(parts) > 1 else ""), {})[channel.upper()] = index
        for layer, channels in layers.items():
            if {"Y", "RY", "BY"} <= channels.keys():
                raise NoColorError(LUMINANCE_CHROMA)
            if colors := _colors(channels):
                alpha = [channels["A"]] if "A" in channels else []
                found.setdefault(layer, ColorChannels(number, colors, alpha))
    main = [layer for layer in found if _last(layer) in BEAUTY] or list(found)
    if not main:
        return _only(parts)
    if len(main) > 1 and _last(main[0]) not in BEAUTY:
        raise NoColorError(f"has color layers {_listed(sorted(found))}; save one of them alone")
    return found[min(main, key=lambda layer: (*BEAUTY, _last(layer)).index(_last(layer)))]


def _listed(names: Sequence[str]) -> str:
    """Return the names for a message of one line."""
    return " ".join(printable(", ".join(names)).split())


def _last(layer: str) -> str:
    return layer.rpartition(".")[2].lower()


def _colors(channels: dict[str, int]) -> list[int]:
    """Return the indices of a layer's color channels; empty for one without, such as a vector's X, Y and Z."""
    wanted = "RGB" if {"R", "G", "B"} <= channels.keys() else "Y" if "Y" in channels and "X" not in channels else ""
    return [channels[name] for name in wanted]


def _only(parts: Sequence[tuple[str, Sequence[str]]]) -> ColorChannels:
    """Return the one channel of an image, whatever its name, beside alpha."""
    names = [name for _, names in parts for name in names]
    others = [index for index, name in enumerate(names) if name.upper() != "A"]
    if len(parts) > 1 or len(others) != 1:
        raise NoColorError(f"has channels {_listed(names)} instead of R, G, B; save its colour layer alone")
    return ColorChannels(0, others, [index for index in range(len(names)) if index not in others])
