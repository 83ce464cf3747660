"""The record of a film's pixels: what a render stores of them, as its scene and choices require."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from ...scene.light_groups import light_groups
from ...scene.model import Scene
from ..film.backdrop import catches, sees_environment
from .choices import Choices
from .records import ALPHA, CATCHER, DIRECT, EXPOSURE, LAUNCH, LAUNCH_OF_CATCHERS, PIXEL, group_record

#: Records that follow PIXEL in a film, by the feature that is compiled in with them.
PARTS = {"DIRECT_LIGHT": DIRECT, "ALPHA": ALPHA, "CATCHER": CATCHER}


def film_features(scene: Scene, choices: Choices) -> set[str]:
    """Return the features that a film with these contents needs: those that have a record in PARTS, and light
    groups."""
    has = {
        "DIRECT_LIGHT": choices.direct_light,
        "ALPHA": not sees_environment(scene),
        "CATCHER": catches(scene),
        "EMITTER_GROUPS": choices.light_groups,
    }
    return {name for name, present in has.items() if present}


def film_groups(scene: Scene, choices: Choices) -> tuple[str, ...]:
    """Return the names of the light groups that the film stores. Raises SceneError for too many."""
    return light_groups(scene) if choices.light_groups else ()


def pixel_record(features: Collection[str], groups: int) -> np.dtype[Any]:
    """Return the record of a film pixel in a program with these features, which stores this many light groups."""
    parts = [PIXEL, *(PARTS[name] for name in PARTS if name in features), *([group_record(groups)] if groups else [])]
    return np.dtype([field for part in parts for field in part.descr])


def film_pixel(scene: Scene, choices: Choices) -> np.dtype[Any]:
    """Return the record of a pixel of the scene's film."""
    return pixel_record(film_features(scene, choices), len(film_groups(scene, choices)))


def launch_type(features: Collection[str]) -> np.dtype[Any]:
    """Return the record of a launch of a program with these features."""
    kind = LAUNCH_OF_CATCHERS if "CATCHER" in features else LAUNCH
    return np.dtype([*kind.descr, *EXPOSURE.descr]) if "TIME" in features else kind
