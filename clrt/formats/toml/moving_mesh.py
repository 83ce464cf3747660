"""[[mesh]] tables whose animation plays in the frames of the scene, with their [[instance]] tables."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from ...scene.animation import ModelAnimation
from ...scene.model import Instance, Model
from ...scene.model_pose import own_materials
from .instance_table import Copies, parts_to_copy


@dataclass
class MovingMesh:
    """What a table shows, in the world, and its animation, as it is played. visible, lights: whether its parts and its
    lights are in the scene; copies: those of its [[instance]] tables; made: these copies in the scene."""

    model: Model
    played: ModelAnimation
    visible: bool
    lights: bool
    copies: list[Copies] = field(default_factory=list)
    made: list[Instance] = field(default_factory=list)

    def add(self, copies: Copies, made: list[Instance]) -> None:
        """Add the copies of an [[instance]] table."""
        self.copies.append(copies)
        self.made += made

    def animation(self) -> ModelAnimation:
        """Return the animation of all that the table and its copies have in the scene."""
        base = shown(self.model, self.visible, self.lights)
        base = replace(base, instances=[*base.instances, *self.made], animation=None)
        return replace(self.played, base=base, pose=self._at, own=own_materials(base) if self.played.own else ())

    def _at(self, seconds: float) -> Model:
        model = self.played.pose(seconds)
        copies = [copy for each in self.copies for copy in each.of(parts_to_copy(model))]
        model = shown(model, self.visible, self.lights)
        return replace(model, instances=[*model.instances, *copies])


def shown(model: Model, visible: bool, lights: bool) -> Model:
    """Return what of a table's model is in the scene."""
    return replace(
        model,
        meshes=model.meshes if visible else [],
        instances=model.instances if visible else [],
        lights=model.lights if lights else [],
        emitters=model.emitters if lights else [],
    )
