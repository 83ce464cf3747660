"""Reference images for error measurements: a scene rendered with many samples once, and cached between runs.

A reference is the mean of steps, renders of STEP_SPP samples each with different seeds. The variance between steps
gives the error of their mean, whatever the sampler; and a cached reference can be extended by further steps.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from ...device.cache_files import REFERENCES, read_file, write_file
from ...output.image_error import RELMSE_FLOOR
from ...rendering.renderer import Renderer
from ...scene.model import Scene

STEP_SPP = 128
#: Seed of the first step; the seeds of later ones count down. Measured renders count up from 0.
FIRST_SEED = 2**32 - 1


@dataclass(frozen=True)
class Reference:
    """Reference image. total, squares: (h, w, 3) float64, sums of images and of their squares; means: (steps, 3).

    step_spp: samples per pixel of a step.
    """

    means: NDArray[np.float64]
    total: NDArray[np.float64]
    squares: NDArray[np.float64]
    step_spp: int = STEP_SPP

    @property
    def steps(self) -> int:
        """Number of steps."""
        return len(self.means)

    @property
    def spp(self) -> int:
        """Samples per pixel."""
        return self.steps * self.step_spp

    @property
    def pixels(self) -> NDArray[np.float32]:
        """Image (h, w, 3), float32, linear Rec. 709."""
        return (self.total / self.steps).astype(np.float32)

    @property
    def relmse(self) -> float:
        """Its own relMSE, estimated from the variance between steps; requires at least two."""
        mean = self.total / self.steps
        variance = np.maximum(self.squares / self.steps - mean**2, 0) / (self.steps - 1)
        return float(np.mean(variance / (mean**2 + RELMSE_FLOOR)))

    @classmethod
    def exact(cls, pixels: NDArray[np.float32]) -> Reference:
        """Return an image (h, w, 3) as a reference without noise: two equal steps of unknown samples per pixel, 0."""
        picture = pixels.astype(np.float64)
        none = cls(np.zeros((0, 3)), np.zeros_like(picture), np.zeros_like(picture), step_spp=0)
        return none.plus(picture).plus(picture)

    def plus(self, picture: NDArray[np.float64]) -> Reference:
        """Return the reference with one more step."""
        return Reference(
            np.append(self.means, [picture.mean((0, 1))], 0),
            self.total + picture,
            self.squares + picture**2,
            self.step_spp,
        )


def render_reference(
    scene: Scene,
    steps: int,
    *,
    device: str | int | None = None,
    step_spp: int = STEP_SPP,
    on_step: Callable[[int], None] = lambda step: None,
) -> Reference:
    """Return the reference of `scene` with at least `steps` steps (2 or more), from the cache as far as possible.

    step_spp: samples per pixel of a step; the larger, the faster errors fall, as samples are stratified within a step.

    The cache key covers all that the image depends on: kernels, buffers, size, depth and camera; a damaged file is
    ignored. on_step: called with the number of each step that has to be rendered. Raises what `Renderer` raises.
    """
    renderer = Renderer(scene, device=device)
    width, height = renderer.settings.size
    name = REFERENCES.replace("*", _digest(renderer, step_spp))
    black = np.zeros((height, width, 3))
    reference = _kept(name, black.shape, step_spp) or Reference(np.zeros((0, 3)), black, black, step_spp)
    while reference.steps < steps:
        on_step(reference.steps)
        reference = reference.plus(_render(scene, step_spp, FIRST_SEED - reference.steps, device))
        _keep(name, reference)
    return reference


def _render(scene: Scene, spp: int, seed: int, device: str | int | None) -> NDArray[np.float64]:
    for state in Renderer(scene, spp=spp, seed=seed, device=device).passes(spp=spp):
        pass
    return state.film.mean


def _digest(renderer: Renderer, step_spp: int) -> str:
    compiled, settings = renderer.compiled, renderer.settings
    digest = hashlib.sha256(compiled.source.encode())
    digest.update(repr((step_spp, settings.size, settings.max_depth, settings.integrator, compiled.camera)).encode())
    for array in [compiled.counts, *(array for _, array in compiled.buffers.values())]:
        if isinstance(array, np.ndarray):  # BVHs built on the device stay there; images do not depend on them
            digest.update(array.tobytes())
    return digest.hexdigest()


def _keep(name: str, reference: Reference) -> None:
    file = BytesIO()
    np.savez(file, means=reference.means, total=reference.total, squares=reference.squares)
    write_file(name, file.getvalue())


def _kept(name: str, shape: tuple[int, ...], step_spp: int) -> Reference | None:
    """Return the reference cached under `name`; None if there is none or it is damaged (archives have checksums)."""
    content = read_file(name)
    if content is None:
        return None
    try:
        stored: Any = np.load(BytesIO(content))
        reference = Reference(stored["means"], stored["total"], stored["squares"], step_spp)
    except (OSError, ValueError, EOFError, KeyError, BadZipFile):
        return None
    return reference if reference.total.shape == reference.squares.shape == shape else None
