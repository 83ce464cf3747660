"""clrt compared with the path tracers of glTF-Render-Fidelity (`fidelity_suite`): is it as close to them as they are to
each other?

Both criteria apply to display values, after the suite's tone mapping. FLIP: clrt's mean distance to the others must be
at most that of the one that is furthest from the rest. Mean luminance, of the whole image and of each material's
region, must be within the range of the others, widened by MARGIN. (A fifth renderer equivalent to the other four would
lie outside of their range by chance in two cases of five.)
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...device.discovery.discover import choose
from ...errors import SceneError, UsageError
from ...formats.images.image_reader import read_picture
from ...formats.models import read_model
from ...output.denoise import Denoiser
from ...output.image_error import compare
from ...output.view_transform import srgb
from ...rendering.renderer import Renderer
from ...scene.materials.material_types import Diffuse, Material
from ...scene.model import Environment, Mesh, RenderSettings, Scene
from ...scene.validation.validate import validate
from .fidelity_suite import (
    WEBSITE_WIDTH,
    Floats,
    Scenario,
    compressed,
    files_of,
    golden,
    over_white,
    reduced,
    shrunk,
    tone_mapped,
)

#: Relative tolerance of a mean beyond the range of the others; smallest fraction of an image that counts as a region.
MARGIN, LEAST = 0.05, 0.005
#: Added to means: lossy compression lets white bleed into adjacent black.
DARK = 0.02
#: Path depth; the center of the environment map is +X in three.js and Cycles, +Z in clrt.
DEPTH, ROTATION = 16, 90.0
#: A pixel belongs to a region if the model covers all of it; the other images' alphas were compressed lossily.
COVERED, STORED_COVERED = 0.999, 0.98
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
Means = Mapping[str, float]


class Judged(NamedTuple):
    """A row of the table; and the display's linear light by renderer, clrt's first, if there are images."""

    row: dict[str, Any]
    images: dict[str, Floats]


class Effort(NamedTuple):
    """Image width in pixels (None: the scenario's own), samples per pixel, denoiser, and the device's index.

    Tone mapping is nonlinear: noise, and text and highlights smaller than a pixel, change means of display values.
    """

    width: int | None
    spp: int
    denoiser: Denoiser | None
    device: int


def judge(
    found: Sequence[Scenario], width: int | None, spp: int, denoise: bool = False, device: str | int | None = None
) -> Iterator[Judged]:
    """Yield each scenario, rendered `width` pixels wide (None: its own) and compared at the website's size or less.

    The row's result: inside or outside of the others' spread; no spread if fewer than two have an image; missing if
    files are; not read if clrt cannot, with `problems`. Raises UsageError without flip-evaluator.
    """
    try:
        import flip_evaluator  # noqa: F401
    except ImportError:
        raise UsageError(
            "FLIP needs flip-evaluator; run pip install flip-evaluator (for Python 3.11 to 3.13, not for Linux on ARM)"
        ) from None
    effort = Effort(width, spp, Denoiser() if denoise else None, choose(device)[0].index)
    for scenario in found:
        row: dict[str, Any] = {"scenario": scenario.name}
        missing = [str(path) for path in (*files_of(scenario.model), scenario.lighting) if not path.is_file()]
        if missing:
            yield Judged(row | {"result": "missing", "problems": missing}, {})
            continue
        try:
            with _warnings() as warnings:
                scene = _scene(scenario, effort.width)
        except SceneError as error:
            yield Judged(row | {"result": "not read", "problems": error.problems}, {})
        else:
            yield _judged(row | {"warnings": warnings}, scenario, scene, effort)


@contextmanager
def _warnings() -> Iterator[list[str]]:
    """Collect the warnings of scene readers, without the file's name."""
    heard: list[str] = []
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: heard.append(record.getMessage().partition(": ")[2])  # type: ignore[method-assign]
    log = logging.getLogger("clrt.scene")
    log.addHandler(handler)
    try:
        yield heard
    finally:
        log.removeHandler(handler)


def _scene(scenario: Scenario, width: int | None) -> Scene:
    """Return the model with its own lights, with the scenario's environment and camera."""
    model = read_model(scenario.model)
    scene = Scene(
        meshes=model.meshes,
        instances=model.instances,
        lights=model.lights,
        camera=scenario.camera,
        environment=Environment(image=read_picture(scenario.lighting), rotation_degrees=ROTATION),
        render=RenderSettings(size=_size(scenario, width or scenario.size[0]), max_depth=DEPTH),
        name=scenario.name,
    )
    validate(scene)
    return scene


def _size(scenario: Scenario, width: int) -> tuple[int, int]:
    return width, max(round(width * scenario.size[1] / scenario.size[0]), 1)


def _judged(row: dict[str, Any], scenario: Scenario, scene: Scene, effort: Effort) -> Judged:
    pixels, objects = _rendered(scene, effort)
    alpha = np.ones((*objects.shape, 1), np.float32)
    if not scenario.skybox:
        pixels, alpha = _without_background(scene, pixels, effort._replace(denoiser=None))
    inside = alpha[..., 0] > COVERED
    size = _size(scenario, min(scene.render.size[0], WEBSITE_WIDTH))
    rgba = shrunk(np.concatenate([srgb(tone_mapped(pixels)), alpha], axis=2, dtype=np.float32), size)
    from_website = any(path.suffix == ".webp" for path in scenario.goldens.values())
    images = {"clrt": over_white(compressed(rgba) if from_website else rgba)[0]}
    stored = np.ones(images["clrt"].shape[:2], np.bool_)
    for renderer, path in scenario.goldens.items():
        if (read := golden(renderer, path, size)) is not None:
            images[renderer], stored_alpha = read
            stored &= scenario.skybox | (stored_alpha > STORED_COVERED)
    names = np.array([_material_name(part) for part in [*scene.meshes, *(one.mesh for one in scene.instances)]] + [""])
    regions = {"": np.ones(stored.shape, np.bool_)} | {
        str(name): stored & _wholly(inside & (objects >= 0) & (names[objects] == name), size)
        for name in dict.fromkeys(names[:-1])
    }
    means = {
        name: {renderer: float((image[where] @ LUMINANCE).mean()) for renderer, image in images.items()}
        for name, where in regions.items()
        if where.mean() >= LEAST
    }
    return Judged(row | verdict(images, means), images)


def _wholly(part: NDArray[np.bool_], size: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the pixels of a smaller image that lie entirely within a region of a larger one."""
    return np.asarray(reduced(part[..., None].astype(np.float32), size)[..., 0] > COVERED)


def _material_name(mesh: Mesh) -> str:
    return mesh.material_name or mesh.name or "?"


def _rendered(scene: Scene, effort: Effort) -> tuple[Floats, NDArray[np.int32]]:
    """Return the pixels, and the object ids of the first hits."""
    renderer = Renderer(
        scene, device=effort.device, spp=effort.spp, aovs="object", first_hits=effort.denoiser is not None
    )
    *_, state = renderer.passes(spp=effort.spp)
    objects = np.asarray(renderer.aovs(state)["object"], np.int32)
    if effort.denoiser is None:
        return state.pixels, objects
    guides = renderer.session.guides()
    return effort.denoiser(state.pixels, guides["albedo"], guides["normal"]), objects


def _without_background(scene: Scene, pixels: Floats, effort: Effort) -> tuple[Floats, Floats]:
    """Return the surfaces' radiance, (h, w, 3), and their coverage of each pixel, (h, w, 1).

    A pixel mixes surfaces and background by coverage; tone mapping applies to the surfaces only.
    """

    def white(material: Material) -> Diffuse:
        return Diffuse(color=(1.0, 1.0, 1.0), opacity=material.opacity, alpha_cutoff=material.alpha_cutoff)

    def masked(mesh: Mesh) -> Mesh:
        return replace(
            mesh,
            material=white(mesh.material),
            colors=None
            if mesh.colors is None
            else np.concatenate([np.ones_like(mesh.colors[:, :3]), mesh.colors[:, 3:]], axis=1),
        )

    meshes = {id(mesh): masked(mesh) for mesh in [*scene.meshes, *(one.mesh for one in scene.instances)]}
    mask = replace(
        scene,
        meshes=[meshes[id(mesh)] for mesh in scene.meshes],
        instances=[replace(one, mesh=meshes[id(one.mesh)], material=None) for one in scene.instances],
        lights=[],
        environment=Environment(),
        render=replace(scene.render, integrator="albedo"),
    )
    alpha = np.clip(_rendered(mask, effort)[0][..., :1], 0, 1)
    background, _ = _rendered(replace(scene, meshes=[], instances=[], lights=[]), effort)
    surfaces = np.maximum(pixels - (1 - alpha) * background, 0) / np.maximum(alpha, 1e-3)
    return np.asarray(surfaces, np.float32), alpha


def verdict(images: Mapping[str, Floats], means: Mapping[str, Means]) -> dict[str, Any]:
    """Return result; flip: clrt's distance to each; mean_flip: their mean, spread: the largest such mean of the others;
    means: by region ("" is the whole image), with `beyond`, clrt's factor outside their range (1 inside, < 1 too dark).
    """
    others = [name for name in images if name != "clrt"]
    distances = {(a, b): _flip(images[a], images[b]) for i, a in enumerate(images) for b in [*images][i + 1 :]}
    mean_flip = {
        a: float(
            np.mean([value for pair, value in distances.items() if a in pair and (a == "clrt" or "clrt" not in pair)])
        )
        for a in images
        if len(others) > 1
    }
    found: dict[str, Any] = {
        "flip": {name: distances["clrt", name] for name in others},
        "means": {name: {**each, "beyond": _beyond(each)} for name, each in means.items()},
    }
    if len(others) < 2:
        return found | {"result": "no spread"}
    spread = max(mean_flip[name] for name in others)
    strayed = [name for name, each in found["means"].items() if abs(np.log(each["beyond"])) > np.log1p(MARGIN)]
    inside = mean_flip["clrt"] <= spread and not strayed
    return found | {
        "mean_flip": mean_flip["clrt"],
        "spread": spread,
        "strayed": strayed,
        "result": "inside" if inside else "outside",
    }


def _beyond(means: Means) -> float:
    ours, others = means["clrt"], [value for name, value in means.items() if name != "clrt"]
    nearest = min(max(ours, min(others)), max(others))
    return (ours + DARK) / (nearest + DARK)


def _flip(a: Floats, b: Floats) -> float:
    value = compare(a, b, hdr=False)["flip"]
    assert isinstance(value, float)
    return value
