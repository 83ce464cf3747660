"""Images of one scene from many cameras, as arrays: light, AOVs and optical flow."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice, tee, zip_longest
from typing import Annotated, Any, Unpack, cast

import numpy as np
from numpy.typing import NDArray

from .aov_types import LIGHT_GROUPS, OF_GROUP, aovs_from
from .device.open import Selectors
from .errors import SceneError, UsageError, check_choice
from .float_errors import with_default_errors
from .rendering.aovs import AOVS
from .rendering.listed_keywords import listed
from .rendering.renderer import Renderer
from .rendering.renderer_options import SETTINGS, PictureOptions, RendererOptions, TracingOptions
from .scene.cameras import CALIBRATED
from .scene.exposure import motion_features
from .scene.model import Camera, Scene
from .scene.on_ground import is_below, on_plain_ground
from .scene.validation.validate import validate
from .scene.view import View

#: AOVs under the names that datasets have for them.
IDS = {"instance_id": "object", "material_id": "material"}
LAYERS = ("rgb", "alpha", *AOVS, *IDS, "flow")
#: AOVs that `flow` is computed from.
FLOW_FROM = ("position", "object")


class ViewOptions(PictureOptions, TracingOptions, total=False):
    """Keywords of views: those of a render but for its checkpoints, and a farm's."""

    device: Annotated[Selectors, "See `clrt devices`, or an open device; several render one image together."]
    scheduler: Annotated[str | None, "A Dask scheduler, tcp://… or tls://…, each of whose workers renders whole views."]


@listed(ViewOptions, SETTINGS)
@with_default_errors
def each_view(
    scene: Scene,
    cameras: Iterable[Camera],
    layers: str | Iterable[str] = ("rgb",),
    **options: Unpack[ViewOptions],
) -> Iterator[View]:
    """Render the scene from each camera in turn; BVHs and programs are kept, and memory does not grow.

    layers: "rgb", linear Rec. 709, 3 channels; "alpha", which makes the images transparent, and "rgb" premultiplied;
    names of AOVs (docs/aovs.md), with "light_groups" a layer of each group, "instance_id" and "material_id" being
    "object" and "material"; "flow", 2 channels: how far to the right and down, in pixels, the next view shows the point
    at the pixel's center, NaN where nothing is hit, or where that view's lens does not image it, and in the last view.
    Without "rgb" and AOVs of light, no light is computed. Raises UsageError for other layers, or for flow with motion
    blur or between cameras neither perspective nor fisheye, SceneError for a camera that cannot be used, and what
    `render` raises.
    """
    names = _chosen(layers)
    aovs = {IDS.get(name, name): None for name in names if name not in ("rgb", "alpha", "flow")}
    aovs |= dict.fromkeys(FLOW_FROM) if "flow" in names else {}
    scheduler = options.pop("scheduler", None)
    given = cast(RendererOptions, {**options, "aovs": list(aovs)})
    lit = not {"rgb", "alpha"}.isdisjoint(names) or not set(aovs).isdisjoint(aovs_from("film"))
    if not lit:
        given["integrator"], given["guiding"] = "normals", "off"  # its program is that of first hits alone
    if "alpha" in names:
        given["transparent"] = True
    seen, ahead = tee(_scenes(scene, cameras, lit))
    if scheduler is None:
        rendered = _rendered(seen, given, lit)
    else:
        from .farm.farm_views import farm_views

        rendered = farm_views(scheduler, seen, given, lit)
    poses = (each.camera for each in ahead)
    for number, ((camera, following), made) in enumerate(zip(_with_next(poses), rendered)):
        if "flow" in names:
            if motion_features(replace(scene, camera=camera)):
                raise UsageError(
                    f"view {number} has motion blur, which flow is not defined for; leave flow or shutter out"
                )
            made["flow"] = _flow(made["position"], np.greater_equal(made["object"], 0), following)
        groups = [name for name in made if name.startswith(OF_GROUP)]
        layers = [layer for name in names for layer in (groups if name == LIGHT_GROUPS else [name])]
        shown = {name: made[IDS.get(name, name)] for name in layers}
        yield View(camera, {name: layer.reshape(*layer.shape[:2], -1) for name, layer in shown.items()})


def _scenes(scene: Scene, cameras: Iterable[Camera], lit: bool) -> Iterator[Scene]:
    """Yield the scene from each camera; if not `lit`, with the ground that its images of light have."""
    worlds: dict[bool, Scene] = {}
    for number, camera in enumerate(cameras):
        with _of_view(number):
            seen = replace(scene, camera=camera)
            validate(Scene(camera=camera, render=scene.render))
        world = scene if lit else worlds.setdefault(is_below(seen), on_plain_ground(seen))
        yield replace(world, camera=camera)


def _rendered(scenes: Iterable[Scene], options: RendererOptions, lit: bool) -> Iterator[dict[str, NDArray[Any]]]:
    """Yield the AOVs of each scene, and "rgb" and "alpha" if `lit`, rendered on this machine."""
    renderer = None
    for number, scene in enumerate(scenes):
        with _of_view(number):
            if renderer is None:
                renderer = Renderer(scene, **options)
            else:
                renderer.show(scene)
        made: dict[str, NDArray[Any]] = dict(renderer.first_hits)
        if lit:
            for state in renderer.passes():
                pass
            made |= renderer.aovs(state) | {"rgb": state.pixels}
            made |= {} if state.alpha is None else {"alpha": state.alpha}
        yield made


@contextmanager
def _of_view(number: int) -> Iterator[None]:
    """Name the view in errors of its camera."""
    try:
        yield
    except SceneError as error:
        raise SceneError([f"view {number}: {problem}" for problem in error.problems]) from None


@listed(ViewOptions, SETTINGS)
def render_views(
    scene: Scene,
    cameras: Iterable[Camera],
    layers: str | Iterable[str] = ("rgb",),
    **options: Unpack[ViewOptions],
) -> dict[str, NDArray[Any]]:
    """Render the scene from each camera; return each layer as one array (views, height, width, channels).

    The arguments and exceptions are those of `each_view`, which does not keep all views in memory.
    """
    poses = list(cameras)
    arrays: dict[str, NDArray[Any]] = {}
    for number, view in enumerate(each_view(scene, poses, layers, **options)):
        for name, layer in view.layers.items():
            array = arrays.setdefault(name, np.empty((len(poses), *layer.shape), layer.dtype))
            array[number] = layer
    return arrays


def _chosen(layers: str | Iterable[str]) -> tuple[str, ...]:
    """Return the names without duplicates. Raises UsageError for names not in LAYERS."""
    listed = layers.split(",") if isinstance(layers, str) else [*layers]
    for name in listed:
        check_choice("layer", name, LAYERS)
    names = tuple(dict.fromkeys(listed))
    if not names:
        raise UsageError(f"there are no layers; choose from {', '.join(LAYERS)}")
    return names


def _with_next(cameras: Iterable[Camera]) -> Iterator[tuple[Camera, Camera | None]]:
    """Yield each camera with the one after it."""
    ahead, following = tee(cameras)
    return zip_longest(ahead, islice(following, 1, None))


def _flow(position: NDArray[Any], hit: NDArray[np.bool_], following: Camera | None) -> NDArray[np.float32]:
    """Return (height, width, 2): the way from each pixel's center to where the next camera sees the same point."""
    height, width = hit.shape
    if following is None:
        return np.full((height, width, 2), np.nan, np.float32)
    if following.projection not in CALIBRATED:
        raise UsageError(
            f"flow is between perspective and fisheye cameras, and one is {following.projection}; leave it out"
        )
    places = np.where(hit[..., None], following.project(position, (width, height)), np.nan)
    centers = np.stack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5), axis=-1)
    flow: NDArray[np.float32] = (places - centers).astype(np.float32)
    return flow
