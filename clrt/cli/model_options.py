"""Options for bare glTF files, which may hold several scenes, animations and variants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from .option_groups import flag
from .option_types import Finite

if TYPE_CHECKING:
    from ..formats.model_choice import ModelChoice


@dataclass(frozen=True)
class ModelOptions:
    """What is read of a bare model."""

    model_scene: str | None = flag(
        "--scene", metavar="NAME", help="Scene of a bare glTF file, by name or number; see `clrt info`."
    )
    variant: str | None = flag(
        "--variant", metavar="NAME", help="Variant of a bare glTF file's materials, by name or number."
    )
    animation: str | None = flag(
        "--animation",
        metavar="NAME",
        help="Animation of a bare glTF file, by name or number; default: none, or with --frames the first.",
    )
    animation_time: float | None = flag(
        "--animation-time",
        type=Finite(),
        metavar="SECONDS",
        help="Time at which the animation, by default the first, is shown as a still.",
    )

    @property
    def choice(self) -> ModelChoice:
        """Return the choice for `load`."""
        from ..formats.model_choice import ModelChoice

        return ModelChoice(
            scene=self.model_scene, variant=self.variant, animation=self.animation, time=self.animation_time
        )
