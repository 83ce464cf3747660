"""The one-call functions of the package."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .output.image import Image
from .rendering.renderer import Renderer
from .rendering.report import render_report
from .scene.file import load as _load
from .scene.model import Scene


def load(path: str | Path) -> Scene:
    """The scene in a .toml file or a bare model (.glb .gltf .obj .ply .stl .off); SceneError lists all its mistakes."""
    return _load(Path(path))


def render(scene: Scene | str | Path, *, spp: int | None = None, time: float | None = None, error: float | None = None,
           reference: NDArray[np.float32] | None = None, **options: Any) -> Image:
    """Renders a scene, or the scene in a file, to the end: see `Renderer.passes` for the stop conditions and
    `Renderer` for `options`. Raises ClrtError subclasses."""
    renderer = Renderer(scene if isinstance(scene, Scene) else load(scene), **options)
    state = None
    for state in renderer.passes(spp=spp, time=time, error=error, reference=reference):
        pass
    assert state is not None  # passes() yields at least once
    return Image(state.pixels, render_report(renderer, state))
