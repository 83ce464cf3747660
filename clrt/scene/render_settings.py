"""Render settings of a scene, which determine its image; no numpy, as the command line reads its options from here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from ..option_fields import option
from .fields.limits import Ge, Gt, Le, Lt
from .fields.validated import Validated

Pixels = Annotated[int, Ge(1), Le(65536)]
Integrator = Literal["path", "direct", "local", "raster", "normals", "albedo", "depth"]
Sampler = Literal["sobol", "stratified", "independent"]
Filter = Literal["box", "tent", "blackman_harris", "gaussian"]
#: Rays for which back faces are invisible.
Culling = Literal["none", "camera", "all"]
NonNegative = Annotated[float, Ge(0)]


@dataclass(frozen=True, kw_only=True)
class RenderSettings(Validated):
    """Default render settings of a scene.

    - size: (width, height) in pixels
    - spp, error: the samples per pixel, and the estimated error (root of relMSE) at which fewer are enough, after which
      a render without other stop conditions stops
    - max_depth: maximum path depth: 1 emission only, 2 direct light, 3 one bounce
    - shadows: whether the integrators local and raster cast shadow rays
    - back_face_culling: which rays ignore the back faces of materials that are not double_sided: "none", those of the
      "camera", or "all"
    - transparent: whether the image has an alpha channel, the covered fraction of each pixel, and shows neither the
      environment nor the backdrop; transparent_glass: whether what is behind the scene shows through smooth glass, too
    - clamp_direct, clamp_indirect: upper limits per channel of one contribution to a sample, for paths of depth 2 at
      most and for longer ones, in the integrators path and direct; 0 does not clamp
    """

    size: tuple[Pixels, Pixels] = option((512, 512), "Image size in pixels.")
    spp: Annotated[int, Ge(1)] = option(64, "Samples per pixel.")
    error: Annotated[float, Gt(0)] | None = None
    max_depth: Annotated[int, Ge(1), Le(1024)] = option(
        8, "Maximum path depth: 1 emission only, 2 direct light, 3 one bounce."
    )
    seed: Annotated[int, Ge(0), Lt(2**32)] = option(0, "Seed of the random number generator.")
    integrator: Integrator = option("path", "Integrator; default: the scene's.")
    shadows: bool = option(True, "Whether local and raster cast shadow rays.")
    sampler: Sampler = option("sobol", "Sample sequence; default: the scene's.")
    filter: Filter = option("box", "Pixel filter; default: the scene's.")
    adaptive: bool = option(False, "Take more samples where the error is larger.")
    back_face_culling: Culling = option(
        "none", "Which rays ignore the back faces of materials that are not double-sided."
    )
    clamp_direct: NonNegative = option(
        0.0, "Clamp each contribution of direct light to a sample to this value; 0: no clamp."
    )
    clamp_indirect: NonNegative = option(
        0.0, "The same for indirect light: fewer fireflies, but the image is biased (too dark)."
    )
    transparent: bool = option(False, "Write an alpha channel, without environment and backdrop behind the scene.")
    transparent_glass: bool = option(False, "Let what is behind the scene show through smooth glass, unrefracted.")
