"""Options for loading a scene or a model, which several commands share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from ..scene.axes_and_units import Axis, LightUnit, Unit
from .option_groups import flag
from .option_types import Assignment, Finite, OneOf

if TYPE_CHECKING:
    from ..formats.model_look import Look
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
    look: Look | None = flag(
        "--look",
        type=OneOf(("studio", "sky", "none")),
        help="Light and ground of a bare model: studio, sky or none. Default: studio, or sky for a file with lights.",
    )
    model_scene: str | None = flag(
        "--scene", metavar="NAME", help="Scene of a bare glTF file, by name or number; see `clrt info`."
    )
    variant: str | None = flag(
        "--variant", metavar="NAME", help="Variant of a bare glTF file's materials, by name or number."
    )
    animation: str | None = flag(
        "--animation",
        metavar="NAME",
        help="Animation of a bare glTF or USD file, by name or number; default: none, or with --frames the first.",
    )
    animation_time: float | None = flag(
        "--animation-time",
        type=Finite(),
        metavar="SECONDS",
        help="Time at which the animation, by default the first, is shown as a still.",
    )
    light_unit: LightUnit | None = flag(
        "--light-unit",
        type=OneOf(get_args(LightUnit)),
        help="Unit of a bare glTF file's lights: candela and lux, W/sr and W/m², or Blender's watts. Default: by the "
        "program that wrote the file, and by the lights' brightness.",
    )
    ignore_extensions: tuple[str, ...] = flag(
        "--ignore-extension",
        multiple=True,
        metavar="NAME",
        help="Read a bare glTF file without this extension, which it requires but clrt does not support.",
    )

    approximate: bool = flag(
        "--approximate",
        default=False,
        is_flag=True,
        help="Replace what clrt lacks of a Mitsuba or pbrt scene by something similar, or leave it out, with a warning "
        "each.",
    )

    parameters: tuple[tuple[str, str], ...] = flag(
        "-D",
        "--define",
        type=Assignment(),
        multiple=True,
        default=(),
        help="Value of a parameter $NAME of a Mitsuba scene, which replaces its default. May be repeated.",
    )

    def load(self, path: Path, moving: bool = False, size: tuple[int, int] | None = None) -> Scene:
        """Load the scene or model. moving: whether its animation is rendered; size: of a bare model's images, if not
        the default one. Raises SceneError."""
        from ..formats.load_scene import load
        from ..formats.model_choice import ModelChoice

        choice = ModelChoice(
            scene=self.model_scene,
            variant=self.variant,
            animation=self.animation,
            time=self.animation_time,
            light_unit=self.light_unit,
            ignore_extensions=self.ignore_extensions or None,
        )
        given = self.approximate, dict(self.parameters), self.look, size
        return load(path, self.camera, self.up, self.unit, choice, moving, *given)
