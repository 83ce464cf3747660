"""A camera with what it saw."""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import NDArray

from .cameras import Camera


class View(NamedTuple):
    """Layers of an image by name, each (height, width, channels), and the camera."""

    camera: Camera
    layers: dict[str, NDArray[Any]]
