"""Options for loading a scene or a model, which several commands share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from ..scene.axes import Axis, Unit
from .option_groups import flag
from .option_types import OneOf

if TYPE_CHECKING:
    from ..scene.model import Scene


@dataclass(frozen=True)
class LoadOptions:
    """How the file is read."""

    camera: str | None = flag(
        "--camera",
        metavar="NAME",
        help="Camera of the scene or model file to use; see `clrt info`. For a bare model also: front, right, back, "
        "left.",
    )
    up: Axis | None = flag(
        "--up",
        type=OneOf(get_args(Axis)),
        help="Axis of a bare model that points up. Default: what the file says, or z for .stl, y for others.",
    )
    unit: Unit | None = flag(
        "--unit", type=OneOf(get_args(Unit)), help="Unit of a bare model's coordinates, to convert them to meters."
    )

    def load(self, path: Path) -> Scene:
        """Load the scene or model. Raises SceneError."""
        from ..formats.load_scene import load

        return load(path, self.camera, self.up, self.unit)
