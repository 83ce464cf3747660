"""The record of a film's pixels: what a render stores of them, as its scene and choices require."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np

from ...scene.model import Scene
from ..film.backdrop import catches, sees_environment
from .choices import Choices
from .records import ALPHA, CATCHER, DIRECT, LAUNCH, LAUNCH_OF_CATCHERS, PIXEL

#: Records that follow PIXEL in a film, by the feature that is compiled in with them.
PARTS = {"DIRECT_LIGHT": DIRECT, "ALPHA": ALPHA, "CATCHER": CATCHER}


def film_features(scene: Scene, choices: Choices) -> set[str]:
    """Return the features that have a record in PARTS."""
    has = {
        "DIRECT_LIGHT": choices.direct_light,
        "ALPHA": not sees_environment(scene),
        "CATCHER": catches(scene),
    }
    return {name for name, present in has.items() if present}


def pixel_record(features: Collection[str]) -> np.dtype[Any]:
    """Return the record of a film pixel in a program with these features."""
    return np.dtype([*PIXEL.descr, *(field for name in PARTS if name in features for field in PARTS[name].descr)])


def launch_type(features: Collection[str]) -> np.dtype[Any]:
    """Return the record of a launch of a program with these features."""
    return LAUNCH_OF_CATCHERS if "CATCHER" in features else LAUNCH
