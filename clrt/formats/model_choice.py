"""What is read of a model file that holds several scenes, animations or variants, in which units, and without what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

from ..errors import SceneError, UsageError
from ..scene.axes_and_units import LightUnit
from ..scene.fields.field_types import field_problems, show

Named = str | int


@dataclass(frozen=True, kw_only=True)
class ModelChoice:
    """Parts of a glTF file by name or number, and the unit of its lights; None for the file's default.

    - scene: which of its scenes
    - animation: which of its animations; None for the pose without any
    - variant: which of its variants of materials (KHR_materials_variants)
    - time: in seconds, at which the animation, by default the first one, is read as a still
    - light_unit: of its lights (see gltf/light_units.py)
    - ignore_extensions: names of extensions that the file may require although clrt does not support them
    """

    scene: Named | None = None
    animation: Named | None = None
    variant: Named | None = None
    time: float | None = None
    light_unit: LightUnit | None = None
    ignore_extensions: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        """Raise UsageError for values of other types, and for an unknown unit."""
        problems = field_problems(ModelChoice, vars(self), "load")
        if problems:
            raise UsageError("\n".join(problems))

    @property
    def animated(self) -> bool:
        """Whether an animation poses the model."""
        return self.animation is not None or self.time is not None

    def given(self) -> list[str]:
        """Return the names of what is not the default."""
        return [field.name for field in fields(self) if getattr(self, field.name) is not None]


#: The default scene, without animation.
DEFAULT = ModelChoice()


def chosen(wanted: Named, names: Sequence[str], what: str) -> int:
    """Return the index of the name, else of the number. Raises SceneError that lists the names; what: "animation"."""
    if wanted in names:
        return names.index(str(wanted))
    if str(wanted).isdecimal() and int(wanted) < len(names):
        return int(wanted)
    remedy = f"use one of {', '.join(map(show, names))}" if names else f"the file has none; leave {what} out"
    raise SceneError(f"{what}: {show(wanted)} is unknown; {remedy}")
