"""Scenes of github.com/mitsuba-renderer/mitsuba-data against their references, as in Mitsuba's own tests.

Each reference is a mean over REFERENCE_SPP samples, with the variance of a single one for every pixel. An image of
BUDGET samples passes Mitsuba's test if at most 1 − ACCEPTED of its pixels and channels deviate more than chance allows
at LEVEL, corrected for their number (Šidák). Biases below a pixel's standard error pass unnoticed; so the luminances of
blocks are tested as well, by the spread of images with different seeds. (Not their colors: white is 1.0011, 0.9997,
0.9997 in the references of white environments.)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...device.discovery.discover import choose
from ...errors import SceneError, UsageError
from ...formats.images.image_reader import read_picture
from ...formats.mitsuba.reader import MitsubaScene, read_mitsuba
from ...formats.scene_parts.notes import UnsupportedError
from ...scene.materials.material_types import Diffuse
from ...scene.model import Mesh, Sphere
from ...scene.spectra import RGB_FROM_XYZ
from ...scene.validation.validate import validate
from ..convergence.bias import ROUNDING
from ..convergence.contestants import choices_on
from ..significance import FAMILY, corrected, mean_test, sidak, t_test
from .agreement import block_means

Doubles = NDArray[np.float64]
Part = TypeVar("Part", Mesh, Sphere)

#: Mitsuba's own: samples of an image, of a reference, the smallest variance assumed, significance level, and the
#: fraction of pixels and channels that must pass.
BUDGET, REFERENCE_SPP, LEAST_VARIANCE, LEVEL, ACCEPTED = 2_000_000, 32_000, 1e-4, 0.01, 0.9975
#: Images with different seeds that the budget is split into, and the side of a block in pixels.
SEEDS, BLOCK = 16, 8
#: Replacement of surfaces that clrt does not support, and the samples per pixel that determine where they are visible.
BLACK, MASK_SPP = Diffuse(color=(0.0, 0.0, 0.0)), 64
#: Relative tolerance: most references were rounded to half precision.
HALF = 2.0**-11


class Case(NamedTuple):
    """A scene, and the images of its mean and its variance in linear Rec. 709."""

    scene: Path
    mean: Path
    variance: Path

    @property
    def name(self) -> str:
        """Folder and file name, without extension."""
        return f"{self.scene.parent.name}/{self.scene.stem}"


class Judged(NamedTuple):
    """A row of the table, and our image and the reference, (h, w, 3) each, if rendered."""

    row: dict[str, Any]
    ours: NDArray[np.float32] | None = None
    theirs: NDArray[np.float32] | None = None


def cases(folder: Path) -> list[Case]:
    """Return a checkout's scenes that have a reference. Raises UsageError if there are none."""
    found = []
    for scene in sorted((folder / "tests" / "scenes").glob("*/*.xml")):
        stem = scene.parent / "refs" / f"{scene.stem.rpartition('_')[0]}_ref_rgb"
        case = Case(scene, stem.with_suffix(".exr"), stem.with_name(stem.name + "_var.exr"))
        if case.mean.is_file() and case.variance.is_file():
            found.append(case)
    if not found:
        raise UsageError(f"{folder}: has no tests/scenes with references; clone mitsuba-renderer/mitsuba-data there")
    return found


def judge(found: list[Case], budget: int = BUDGET, device: str | int | None = None) -> Iterator[Judged]:
    """Yield each case in turn, rendered and tested, or the features that clrt does not support."""
    number = choose(device)[0].index
    for case in found:
        row: dict[str, Any] = {"scene": case.name}
        try:
            read = _read(case.scene)
        except UnsupportedError as error:
            yield Judged(row | {"result": "not expressible", "missing": error.features, "problems": error.problems})
        except SceneError as error:
            yield Judged(row | {"result": "not read", "missing": error.problems, "problems": error.problems})
        else:
            yield _rendered(row, case, read, budget, number)


def _read(path: Path) -> MitsubaScene:
    """Read the scene; if it has direct lighting only, unsupported surfaces become black, which affects no other pixels.
    Raises UnsupportedError if only these are visible."""
    try:
        read = read_mitsuba(path)
    except UnsupportedError as error:
        try:
            read = read_mitsuba(path, BLACK)
        except UnsupportedError:
            raise error from None
        if not _judges_others(read):
            raise
    validate(read.scene)
    return read


def _judges_others(read: MitsubaScene) -> bool:
    """Return whether supported surfaces are visible, and do not depend on replaced ones."""
    scene = read.scene
    parts: list[Mesh | Sphere] = [*scene.meshes, *scene.spheres]
    shown = {part.name for part in parts if not any(part.material.radiance)}
    direct = scene.render.integrator == "direct" or scene.render.max_depth <= 2
    return direct and not scene.instances and not shown <= {*read.missing}


def _shown(read: MitsubaScene, device: int) -> NDArray[np.bool_]:
    """Return which pixels, (h, w), show no replaced surface, nor do their neighbors."""
    scene = read.scene

    def masked(part: Part) -> Part:
        white = 1.0 if part.name in read.missing else 0.0
        solid = Diffuse(color=(white, white, white), opacity=part.material.opacity)
        return replace(part, material=solid)

    mask = replace(
        scene,
        meshes=[*map(masked, scene.meshes)],
        spheres=[*map(masked, scene.spheres)],
        render=replace(scene.render, integrator="albedo"),
    )
    seen = np.pad(choices_on(mask, [device], {"mask": {}})["mask"](MASK_SPP, 0).pixels.max(axis=2) > 0, 1)
    around = [seen[y : seen.shape[0] - 2 + y, x : seen.shape[1] - 2 + x] for y in range(3) for x in range(3)]
    return np.asarray(~np.any(around, axis=0))


def _rendered(row: dict[str, Any], case: Case, read: MitsubaScene, budget: int, device: int) -> Judged:
    theirs, variance = read_picture(case.mean), read_picture(case.variance)
    height, width = theirs.shape[:2]
    if read.scene.render.size != (width, height):
        raise UsageError(f"{case.mean}: has {width}x{height} pixels, but its scene {read.scene.render.size}")
    spp = max(budget // (width * height) // SEEDS, 1)
    renderer = choices_on(read.scene, [device], {"clrt": {}})["clrt"]
    pictures = np.array([renderer(spp, seed).pixels for seed in range(SEEDS)], np.float64)
    shown = _shown(read, device) if read.missing else np.ones((height, width), np.bool_)
    for array in (pictures, theirs, variance):
        array[..., ~shown, :] = 0
    row |= {
        "result": "failed",
        "differences": read.differences,
        "size": [width, height],
        "spp": spp * SEEDS,
        "missing": list(dict.fromkeys(each for features in read.missing.values() for each in features)),
        "judged": float(shown.mean()),
    }
    row |= pixel_test(spp * SEEDS, *(_xyz(array[shown]) for array in (pictures.mean(0), theirs, variance)))
    row |= block_test(_xyz(pictures), _xyz(theirs), _xyz(variance))
    row |= {"mean_ratio": _ratio(pictures.mean((0, 1, 2)), theirs.astype(np.float64).mean((0, 1)))}
    if row["passes"]:
        row["result"] = "passed"
    return Judged(row, pictures.mean(0).astype(np.float32), theirs)


def pixel_test(spp: int, ours: Doubles, theirs: Doubles, variance: Doubles) -> dict[str, Any]:
    """Apply Mitsuba's test to pixels (n, 3) in XYZ. passes; rejected, tests: numbers of pixels and channels."""
    p = mean_test(ours, np.maximum(variance, LEAST_VARIANCE), spp, theirs)
    rejected = np.count_nonzero(p <= sidak(LEVEL, p.size // 3))
    return {"passes": bool(p.size - rejected >= ACCEPTED * p.size), "rejected": int(rejected), "tests": p.size}


def block_test(ours: Doubles, theirs: Doubles, variance: Doubles) -> dict[str, Any]:
    """Compare the reference with the means of blocks in images with different seeds, (seeds, h, w, 3).

    block_p: the smallest p-value by Student's t, corrected; blocks_rejected of `blocks`; noise: the median standard
    error of a block relative to its mean.
    """
    own = np.array([block_means(each, BLOCK)[..., 1] for each in ours])
    expected = block_means(theirs, BLOCK)[..., 1]
    rounding = ROUNDING * (np.abs(expected) + theirs[..., 1].mean())
    squared = (
        own.var(0) / (len(own) - 1)
        + rounding**2
        + block_means(np.maximum(variance, 0), BLOCK)[..., 1] / (BLOCK**2 * REFERENCE_SPP)
    )
    difference = np.maximum(np.abs(own.mean(0) - expected) - HALF * np.abs(expected), 0)
    error = np.sqrt(squared)
    t = np.divide(difference, error, out=np.zeros_like(difference), where=error > 0)
    p = np.array([corrected(t_test(each, len(own) - 1), t.size) for each in t.ravel().tolist()]).reshape(t.shape)
    p[(error == 0) & (difference != 0)] = 0
    lit = expected > 0
    return {
        "block_p": float(p.min()),
        "blocks": p.size,
        "blocks_rejected": int(np.count_nonzero(p < FAMILY)),
        "noise": float(np.median(error[lit] / expected[lit])) if lit.any() else 0.0,
    }


def _xyz(pixels: NDArray[Any]) -> Doubles:
    return np.asarray(pixels.astype(np.float64) @ np.linalg.inv(RGB_FROM_XYZ).T)


def _ratio(ours: Doubles, theirs: Doubles) -> list[float]:
    ratios: list[float] = np.divide(ours, theirs, out=np.ones(3), where=theirs > 0).tolist()
    return ratios
