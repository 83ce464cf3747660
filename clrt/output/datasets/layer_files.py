"""Files of one view: its colors as .png, with its alpha if it has one, and its other layers as channels of one .exr."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...aov_types import channel_names
from ...scene.model import Camera
from ..images import write_channels, write_image

Layers = Mapping[str, NDArray[Any]]
#: Channel names of layers that are no AOVs.
OTHER_CHANNELS = {"alpha": "A", "instance_id": "X", "material_id": "X", "flow": "UV"}


class SavedView(NamedTuple):
    """A view whose files are written. file: of its colors, else of its other layers; layers_file: of those, "" if there
    are none; both relative to the folder."""

    camera: Camera
    size: tuple[int, int]
    layers: Layers
    file: str
    layers_file: str


def save_view(folder: Path, name: str, camera: Camera, layers: Layers) -> SavedView:
    """Write the layers (height, width, channels) of one view."""
    colors = [name for name in ("rgb", "alpha") if "rgb" in layers and name in layers]
    others = {key: layer for key, layer in layers.items() if key not in colors}
    image, layers_file = f"images/{name}.png" if "rgb" in layers else "", f"layers/{name}.exr" if others else ""
    if image:
        write_image(folder / image, np.concatenate([layers[name] for name in colors], axis=2, dtype=np.float32))
    if others:
        channels = [channel for key in others for channel in _channels(key)]
        samples = np.concatenate([layer.astype(np.float32) for layer in others.values()], axis=2)
        write_channels(folder / layers_file, samples, channels)
    height, width = next(iter(layers.values())).shape[:2]
    return SavedView(camera, (width, height), layers, image or layers_file, layers_file)


def _channels(name: str) -> list[str]:
    if name in OTHER_CHANNELS:
        return [f"{name}.{channel}" for channel in OTHER_CHANNELS[name]]
    return channel_names(name)
