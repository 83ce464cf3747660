"""Keywords of a renderer: their types, and the settings objects that they are the fields of."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Annotated, Any, TypedDict

from ..accel.methods import BoxTest, BuilderName, HitTests, LayoutName, SphereTest, TriangleTest
from ..device.device_info import Paths
from ..device.open import Selectors
from ..errors import ObjectError, SceneError
from ..file_names import StrPath
from ..scene.render_settings import Culling, Filter, Integrator, RenderSettings, Sampler
from .aovs import chosen_aovs, needs_direct_light, needs_light_groups, seen_first
from .checkpoint.policy import CheckpointPolicy
from .compile.choices import Choices, Guiding, Lanes, Offset

if TYPE_CHECKING:
    from .renderer import Renderer

#: Settings objects that keywords are the fields of, which have their defaults and descriptions.
SETTINGS = (RenderSettings, Choices, HitTests, CheckpointPolicy)


class PictureOptions(TypedDict, total=False):
    """Fields of RenderSettings; those left out, or None, are the scene's."""

    size: tuple[int, int] | None
    spp: Annotated[
        int | None,
        "Planned samples per pixel: the sampler makes neighboring pixels' errors differ at "
        "this count and starts afresh after it (kernels/sampler); `passes` stops there.",
    ]
    max_depth: int | None
    seed: int | None
    integrator: Integrator | None
    shadows: bool | None
    sampler: Sampler | None
    filter: Filter | None
    adaptive: bool | None
    back_face_culling: Culling | None
    clamp_direct: float | None
    clamp_indirect: float | None
    transparent: bool | None
    transparent_glass: bool | None


class TracingOptions(TypedDict, total=False):
    """Fields of Choices and HitTests; the defaults suit the device and the scene, others are for comparison."""

    lanes: Lanes | None
    paths: Paths | None
    triangle: TriangleTest
    box: BoxTest
    sphere: SphereTest
    offset: Offset
    builder: BuilderName | None
    layout: LayoutName | None
    tree: bool | None
    guiding: Guiding
    first_hits: bool


class CheckpointOptions(TypedDict, total=False):
    """Fields of CheckpointPolicy."""

    checkpoint: StrPath | None
    resume: bool
    checkpoint_seconds: float


class RendererOptions(PictureOptions, TracingOptions, CheckpointOptions, total=False):
    """Keywords of `Renderer`."""

    device: Annotated[Selectors, "See `clrt devices`, or an open device; several render one image together."]
    error_percentile: Annotated[
        float | None, "A target error counts as reached once this percentage of the tiles of 8x8 pixels has reached it."
    ]
    aovs: Annotated[str | Iterable[str] | None, "Names of AOVs to render as well (docs/aovs.md)."]
    on_phase: Annotated[
        Callable[[str], None] | None,
        'Called with "build" (packing, BVH build) and "compile" (program build, upload), or "train" if the guiding '
        "field is trained as well, as each begins.",
    ]
    before: Annotated[
        Renderer | None,
        "A renderer no longer needed; its device resources are reused as far as its "
        "scene consists of the same objects, unmodified.",
    ]


def settings_of(settings: RenderSettings, options: Mapping[str, object]) -> RenderSettings:
    """Return a scene's settings, overridden by the given options; None means not given. Raises SceneError for invalid
    ones."""
    try:
        return replace(settings, **_given(options, RenderSettings))
    except ObjectError as error:
        raise SceneError(error.named("render")) from None


def choices_of(options: Mapping[str, object]) -> Choices:
    """Return the choices, including those that the requested AOVs imply. Raises UsageError for unknown values."""
    aovs: Any = options.get("aovs")
    names, chosen = chosen_aovs(aovs), _given(options, Choices)
    by_aovs = {"direct_light": needs_direct_light(names), "light_groups": needs_light_groups(names)}
    by_aovs |= {"first_hits": True} if seen_first(names) else {}
    return Choices(**{**chosen, **by_aovs, "tests": HitTests(**_given(options, HitTests))})


def checkpoints_of(options: Mapping[str, object]) -> CheckpointPolicy:
    """Return when to write checkpoints."""
    return CheckpointPolicy(**_given(options, CheckpointPolicy))


def beyond(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that are neither settings nor choices."""
    known = {field.name for kind in (RenderSettings, Choices, HitTests) for field in fields(kind)}
    return {name: value for name, value in options.items() if name not in known}


def _given(options: Mapping[str, object], kind: Any) -> dict[str, Any]:
    """Return the given options that are fields of a dataclass."""
    return {field.name: options[field.name] for field in fields(kind) if options.get(field.name) is not None}
