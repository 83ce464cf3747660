"""The one-call functions of the package."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .output.data import check_denoisable
from .output.denoise import Denoiser, denoised
from .output.image import Image
from .rendering.guides import render_guides
from .rendering.renderer import Renderer
from .rendering.report import render_report
from .rendering.stops import planned_spp
from .scene.file import load as _load
from .scene.model import Scene


def load(path: str | Path, camera: str | None = None) -> Scene:
    """The scene in a .toml file or a bare model (.glb .gltf .obj .ply .stl .off), seen by a camera of the model file
    if one is named; SceneError lists all its mistakes."""
    return _load(Path(path), camera)


def render(scene: Scene | str | Path, *, spp: int | None = None, time: float | None = None, error: float | None = None,
           reference: NDArray[np.float32] | None = None, denoise: bool = False, **options: Any) -> Image:
    """Renders a scene, or the scene in a file, to the end: see `Renderer.passes` for the stop conditions and
    `Renderer` for `options`. denoise: see docs/denoise.md; the image keeps its `raw` pixels. Raises ClrtError
    subclasses."""
    denoiser = Denoiser() if denoise else None
    scene = scene if isinstance(scene, Scene) else load(scene)
    renderer = Renderer(scene, spp=planned_spp(scene.render, spp, time, error), **options)
    if denoise:
        check_denoisable(renderer.settings.integrator)
    guides = render_guides(renderer.session) if denoiser else {}
    state = None
    for state in renderer.passes(spp=spp, time=time, error=error, reference=reference):
        pass
    assert state is not None  # passes() yields at least once
    image = Image(state.pixels, render_report(renderer, state), aovs=renderer.aovs(state))
    return denoised(image, denoiser, guides, reference) if denoiser else image
