"""Warnings about a render: logged once each, and listed in its report."""

from __future__ import annotations

import logging
from collections.abc import Iterable

import numpy as np

from ..scene.exposure import is_moving
from ..scene.model import RenderSettings, Scene
from ..scene.validation.winding import backward_emitters
from .compile.features import INTEGRATORS, WITH_LIGHT, biased_by
from .film.film import Film

#: Linear radiance below which a .png of 8 bits is black: half a level of sRGB's straight part.
BLACK = 0.5 / 255 / 12.92
#: Cause of a black image if no other is known.
DARK = "no light reaches what the camera sees"
_log = logging.getLogger(__name__)


def nonfinite_warnings(dropped: int, samples: int) -> list[str]:
    """Return one warning if samples were dropped, else none."""
    return (
        [
            f"{dropped} of {samples} samples were not finite and were dropped, so the image may be too dark; look "
            "for extreme values in lights, textures and materials"
        ]
        if dropped
        else []
    )


def bias_warnings(settings: RenderSettings, removed: float) -> list[str]:
    """Return one warning if a setting biases the image, else none. removed: the fraction of the light."""
    if not (names := biased_by(settings)):
        return []
    return [
        f"the image is biased by {' and '.join(names)}: {removed:.2%} of the light was removed; the estimated "
        "error does not include this bias"
    ]


def motion_warnings(scene: Scene) -> list[str]:
    """Return one warning if something has a motion that the exposure is too short for, else none."""
    given = scene.camera.end is not None or any(map(is_moving, scene.instances))
    if scene.camera.exposure > 0 or not given:
        return []
    return [
        "what moves is not blurred, as the camera's exposure takes 0 seconds; write shutter = [0, 0.02] or such in "
        "[camera]"
    ]


def black_warnings(settings: RenderSettings, features: Iterable[str], brightest: float, cause: str) -> list[str]:
    """Return one warning if an image of light is black although something emits: its brightest value is below BLACK.
    cause: the likely cause if that value is 0. An image of catchers may have shadows alone."""
    if brightest >= BLACK or not _shows_light(settings) or _is_dark(features) or "CATCHER" in features:
        return []
    if brightest > 0:
        stops = np.ceil(-np.log2(2 * brightest))
        cause = f"its brightest value is {brightest:.2g}; --exposure {stops:.0f} makes it visible"
    x, y = (length // 2 for length in settings.size)
    advice = f"; `clrt debug SCENE --pixel {x},{y}` shows why" if settings.integrator in WITH_LIGHT else ""
    return [f"the image is black: {cause}{advice}"]


class PictureWarnings:
    """Warnings about the renders of one scene. features: those of its program; before: of a previous scene, whose
    warnings are not logged again."""

    def __init__(self, scene: Scene, features: Iterable[str], before: PictureWarnings | None = None) -> None:
        self._scene, self._features = scene, list(features)
        self._logged: set[str] = set(before._logged) if before else set()
        self._backward = backward_emitters(scene) if _shows_light(scene.render) else []
        self._of_scene = [
            f'the emissive mesh "{name}" emits light only away from the scene; reverse the order of its '
            "faces' vertices, or set double_sided = true in its material"
            for name in self._backward
        ]
        if _shows_light(scene.render) and _is_dark(self._features):
            self._of_scene.append("the image is black: nothing in this scene emits light")
        self._of_scene += motion_warnings(scene)
        if "CATCHER" in self._features and not scene.render.transparent and scene.backdrop is None:
            self._of_scene.append(
                "what catchers catch is not visible on black; add transparent = true to [render], or a [backdrop]"
            )
        self._log_new(self._of_scene)

    def of(self, film: Film) -> list[str]:
        """Return all warnings for the image so far, one line each; for a band of an image only those of the scene."""
        return [*self._of_scene, *self._of_film(film)]

    def log(self, film: Film) -> None:
        """Log the warnings of a finished image that were not logged for the scene or for previous images."""
        self._log_new(self._of_film(film))

    def _log_new(self, texts: Iterable[str]) -> None:
        for text in texts:
            named = f"{self._scene.name}: {text}"
            if named not in self._logged:
                _log.warning("%s", named)
            self._logged.add(named)

    def _of_film(self, film: Film) -> list[str]:
        settings = self._scene.render
        if film.size != settings.size or not film.samples:
            return []
        return [
            *nonfinite_warnings(film.nonfinite_samples, film.samples),
            *bias_warnings(settings, film.clamped_part),
            *black_warnings(settings, self._features, float(film.mean.max()), self._cause(film)),
        ]

    def _cause(self, film: Film) -> str:
        """Return the likely cause of an image without any light."""
        if film.nonfinite_samples == film.samples:
            return "none of its samples is finite"
        if self._scene.render.max_depth == 1:
            return "max_depth is 1, which shows emission alone, and the camera sees no emitter"
        if self._backward:
            return f'"{self._backward[0]}" emits light only away from the scene'
        if film.rays == film.samples:
            return "camera rays hit nothing, or only surfaces that reflect nothing"
        return DARK


def _shows_light(settings: RenderSettings) -> bool:
    return settings.integrator in INTEGRATORS


def _is_dark(features: Iterable[str]) -> bool:
    return not {"LIGHTS", "SKY"} & set(features)
