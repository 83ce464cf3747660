"""Comparison of clrt and Cycles on scenes built in Blender (`blender_scenes`): mean radiance per object."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...device.discovery.discover import choose
from ...errors import UsageError
from ...rendering.renderer import Renderer
from ...scene.model import FloatArray, Scene
from .agreement import mean_ratio
from .blender_scenes import COLORS, MATERIALS, SCENES, build, exported
from .cycles_renderer import Cycles


class Judged(NamedTuple):
    """Comparison of one scene. ratios: mean radiance in clrt over that in Cycles, by object; errors: their standard
    errors; images: by renderer, (h, w, 3) float32, linear Rec. 709, means over the seeds."""

    scene: str
    material: str
    ratios: dict[str, float]
    errors: dict[str, float]
    images: dict[str, FloatArray]


def judge(
    scenes: Collection[str], materials: Collection[str], spp: int, seeds: int, device: str | int | None = None
) -> Iterator[Judged]:
    """Compare each of `scenes` with each of `materials` (empty: all), rendered by both with seeds 1 to `seeds` (>= 2).

    Raises UsageError for names that are not in SCENES or MATERIALS, and if Blender is not installed.
    """
    for chosen, known in ((scenes, SCENES), (materials, MATERIALS)):
        if unknown := [name for name in chosen if name not in known]:
            raise UsageError(f"{unknown[0]}: is unknown; choose from {', '.join(known)}")
    try:
        library = import_module("bpy")
    except ImportError:
        raise UsageError("Blender is not installed; run pip install bpy, with Python 3.11") from None
    number = choose(device)[0].index
    return (
        _judged(library, scene, material, spp, range(1, seeds + 1), number)
        for scene in scenes or SCENES
        for material in materials or MATERIALS
    )


def _judged(library: Any, scene: str, material: str, spp: int, seeds: range, device: int) -> Judged:
    with TemporaryDirectory() as folder:
        made = build(library, scene, material, Path(folder))
        content = exported(library, made, Path(folder))
        cycles = Cycles(library, lambda _: made)
        theirs = np.array([cycles(spp, seed).pixels for seed in seeds])
    ours, objects = zip(*(_rendered(content, spp, seed, device) for seed in seeds))
    names = np.array([mesh.material_name for mesh in content.meshes] + [""])[objects[0]]
    ratios, errors = compared(np.array(ours), theirs, {name: names == name for name in COLORS})
    return Judged(scene, material, ratios, errors, {"clrt": np.mean(ours, axis=0), "Cycles": theirs.mean(0)})


def _rendered(scene: Scene, spp: int, seed: int, device: int) -> tuple[NDArray[np.float32], NDArray[np.generic]]:
    """Return the pixels, and the object ids of the first hits."""
    renderer = Renderer(scene, spp=spp, seed=seed, device=device, aovs="object")
    *_, state = renderer.passes(spp=spp)
    return state.pixels, renderer.aovs(state)["object"]


def compared(
    ours: FloatArray, theirs: FloatArray, regions: Mapping[str, NDArray[np.bool_]]
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the ratios of means over the pixels (h, w) of each region and all channels, and their standard errors.

    ours, theirs: images (seeds, h, w, 3).
    """
    means = [
        np.column_stack([images[:, where].mean((1, 2), dtype=np.float64) for where in regions.values()])
        for images in (ours, theirs)
    ]
    ratios, errors = mean_ratio(*means)
    return dict(zip(regions, ratios.tolist())), dict(zip(regions, errors.tolist()))
