"""Scenes at a size that suits a measurement."""

from __future__ import annotations

from dataclasses import replace
from math import ceil

from ...scene.model import Scene

#: Width of images with --quick; otherwise it is the scene's.
SMALL = 24


def smaller(scene: Scene, width: int = SMALL) -> Scene:
    """Return the scene at most this wide, with the same aspect ratio."""
    across, down = scene.render.size
    if across <= width:
        return scene
    return replace(scene, render=replace(scene.render, size=(width, ceil(down * width / across))))
