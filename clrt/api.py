"""The package's top-level functions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple, Unpack, cast

import numpy as np
from numpy.typing import NDArray

from .errors import UsageError
from .file_names import StrPath
from .float_errors import with_default_errors
from .formats.load_scene import load as _load
from .formats.model_choice import ModelChoice
from .formats.model_look import Look
from .formats.trimesh_models import is_trimesh, scene_of
from .output.data_images import check_denoisable
from .output.denoise import Denoiser, denoised
from .output.image import Image
from .rendering.listed_keywords import listed
from .rendering.render_report import render_report
from .rendering.renderer import Renderer, State
from .rendering.renderer_options import SETTINGS, RendererOptions
from .rendering.stop_conditions import planned_spp
from .scene.axes_and_units import Axis, LightUnit, Unit
from .scene.camera_path import frames as _frames
from .scene.fields.keywords import with_known_keywords
from .scene.model import Scene

#: A mesh or a scene of trimesh, which has no types.
Trimesh = Any


@with_known_keywords
@with_default_errors
def load(
    path: StrPath | Trimesh,
    camera: str | None = None,
    *,
    up: Axis | None = None,
    unit: Unit | None = None,
    scene: str | int | None = None,
    variant: str | int | None = None,
    animation: str | int | None = None,
    time: float | None = None,
    light_unit: LightUnit | None = None,
    ignore_extensions: Iterable[str] = (),
    approximate: bool = False,
    parameters: Mapping[str, str] = {},
    look: Look | None = None,
    size: tuple[int, int] | None = None,
) -> Scene:
    """Load a scene file (.toml, Mitsuba's .xml, pbrt's .pbrt) or a bare model (glTF, USD, OBJ, PLY, STL, OFF or 3MF).

    A mesh or scene of trimesh is a bare model, too, with the materials that it has in glTF.

    camera: the name of one of the file's cameras to use, or for a bare model "front", "right", "back" or "left". For a
    bare model also up: which of its axes points up, "x", "y" or "z"; unit: that of its coordinates, "m", "cm", "mm",
    "in" or "ft", which become meters; look: its light and ground, "studio" (the default of a model without lights of
    its own), "sky" or "none"; size: (width, height) of its images, which its camera frames it in.

    Of a bare glTF file, by name or number: `scene` is one of its scenes, `variant` one of the variants of its materials
    (KHR_materials_variants), and `animation` one of its animations, which `animate` renders. time: the seconds at which
    the animation, by default the first one, is shown as a still. light_unit: "photometric" for lights in candela and
    lux, "radiometric" for W/sr and W/m², "blender" for watts; by default as the file's generator and their brightness
    suggest. ignore_extensions: names of extensions that the file may require although clrt does not support them.

    approximate: of a Mitsuba or pbrt scene, what clrt lacks is replaced by something similar or left out, with a
    warning each, instead of an error. parameters: of a Mitsuba scene, values of $NAME in it, which replace its
    defaults.

    Raises SceneError, which lists all problems.
    """
    if not isinstance(ignore_extensions, Iterable):
        raise UsageError(f"ignore_extensions {ignore_extensions!r} is not a list of names")
    given = (ignore_extensions,) if isinstance(ignore_extensions, str) else tuple(ignore_extensions)
    choice = ModelChoice(
        scene=scene,
        variant=variant,
        animation=animation,
        time=time,
        light_unit=light_unit,
        ignore_extensions=given or None,
    )

    def load_file(file: StrPath) -> Scene:
        return _load(
            file, camera, up, unit, choice, approximate=approximate, parameters=parameters, look=look, size=size
        )

    return scene_of(path, load_file) if is_trimesh(path) else load_file(cast(StrPath, path))


@listed(RendererOptions, SETTINGS)
@with_default_errors
def render(
    scene: Scene | StrPath | Trimesh,
    *,
    time: float | None = None,
    error: float | None = None,
    reference: NDArray[np.float32] | None = None,
    denoise: bool = False,
    **options: Unpack[RendererOptions],
) -> Image:
    """Render a scene, or what `load` accepts, until `spp`, `time` or `error` is reached.

    These and `reference` are as in `Renderer.passes`. denoise: see docs/denoise.md; the image keeps its `raw` pixels.
    Raises subclasses of ClrtError.
    """
    denoiser = Denoiser() if denoise else None
    scene = scene if isinstance(scene, Scene) else load(scene, size=options.get("size"))
    stops = Stops(options.get("spp"), time, error)
    return _rendered(_renderer(scene, stops, denoise, options), denoiser, reference, stops)


@listed(RendererOptions, SETTINGS)
def animate(
    scene: Scene | StrPath,
    *,
    frames: Iterable[int] | None = None,
    time: float | None = None,
    error: float | None = None,
    denoise: bool = False,
    **options: Unpack[RendererOptions],
) -> Iterator[tuple[int, Image]]:
    """Render an animation, all `frames` or the given numbers; yields each frame's number and image.

    The other arguments are as in `render`, per frame. Raises SceneError if the scene has no animation, and subclasses
    of ClrtError.
    """
    denoiser = Denoiser() if denoise else None
    scene = scene if isinstance(scene, Scene) else _load(scene, moving=True, size=options.get("size"))
    renderer, stops = None, Stops(options.get("spp"), time, error)
    for number, still in _frames(scene, frames):
        if renderer is None:
            renderer = _renderer(still, stops, denoise, options)
        else:
            renderer.show(still)
        yield number, _rendered(renderer, denoiser, None, stops)


class Stops(NamedTuple):
    """Stop conditions of a render."""

    spp: int | None
    time: float | None
    error: float | None


def image_of(renderer: Renderer, state: State) -> Image:
    """Return the image in a state of its renderer, with its report and AOVs."""
    return Image(
        state.pixels, render_report(renderer, state), None, renderer.aovs(state), state.alpha, state.film.backdrop
    )


def _renderer(scene: Scene, stops: Stops, denoise: bool, options: RendererOptions) -> Renderer:
    options["spp"] = planned_spp(scene.render, *stops)
    options["first_hits"] = denoise or options.get("first_hits", False)
    return Renderer(scene, **options)


@with_default_errors
def _rendered(
    renderer: Renderer, denoiser: Denoiser | None, reference: NDArray[np.float32] | None, stops: Stops
) -> Image:
    if denoiser:
        check_denoisable(renderer.settings.integrator)
    guides = renderer.session.guides() if denoiser else {}
    state = None
    for state in renderer.passes(reference=reference, **stops._asdict()):
        pass
    assert state is not None  # passes() yields at least once
    renderer.warnings.log(state.film)
    image = image_of(renderer, state)
    return denoised(image, denoiser, guides, reference) if denoiser else image
