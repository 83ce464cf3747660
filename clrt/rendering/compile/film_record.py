"""The record of a film's pixels: what a render stores of them, as its scene and choices require."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from ...scene.model import Scene
from .choices import Choices
from .records import ALPHA, DIRECT, PIXEL

#: Records that follow PIXEL in a film, by the feature that is compiled in with them.
PARTS = {"DIRECT_LIGHT": DIRECT, "ALPHA": ALPHA}


def film_features(scene: Scene, choices: Choices) -> set[str]:
    """Return the features that have a record in PARTS."""
    has = {"DIRECT_LIGHT": choices.direct_light, "ALPHA": hides_environment(scene)}
    return {name for name, present in has.items() if present}


def pixel_record(features: Collection[str]) -> np.dtype[Any]:
    """Return the record of a film pixel in a program with these features."""
    return np.dtype([*PIXEL.descr, *(field for name in PARTS if name in features for field in PARTS[name].descr)])


def hides_environment(scene: Scene) -> bool:
    """Return whether the camera does not see the environment behind the scene."""
    return scene.render.transparent or scene.backdrop is not None or not scene.environment.camera_visible
