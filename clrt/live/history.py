"""Undo and redo of scene edits, as steps that replace parts of a scene."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

from ..scene.model import Scene

Parts = dict[str, Any]
#: Maximum number of steps that can be undone; older ones are dropped with the parts that they replaced.
STEPS = 200


class History:
    """Steps from one scene to the next. A step stores only the parts that it replaced (fields of Scene, by identity),
    so changes that are not steps, such as the camera of a walk, are kept when one is undone."""

    def __init__(self) -> None:
        self._done: list[tuple[Parts, Parts]] = []
        self._undone: list[tuple[Parts, Parts]] = []
        self._going_on = False

    def record(self, before: Scene, after: Scene, goes_on: bool = False) -> None:
        """Record a step; goes_on: the next one is merged into it, such as each position of a dragged object."""
        names = [each.name for each in fields(Scene) if getattr(before, each.name) is not getattr(after, each.name)]
        old, new = ({name: getattr(scene, name) for name in names} for scene in (before, after))
        if self._going_on and self._done:
            first, last = self._done.pop()
            old, new = old | first, last | new
        if new:
            self._done = [*self._done[1 - STEPS :], (old, new)]
            self._undone.clear()
        self._going_on = goes_on and bool(new)

    def undo(self, scene: Scene) -> Scene:
        """Return the scene without the last step, or the scene itself if there is none."""
        return self._move(scene, self._done, self._undone, 0)

    def redo(self, scene: Scene) -> Scene:
        """Return the scene with the step that was undone last, or the scene itself if there is none."""
        return self._move(scene, self._undone, self._done, 1)

    @property
    def can_undo(self) -> bool:
        """Whether there is a step to undo."""
        return bool(self._done)

    @property
    def can_redo(self) -> bool:
        """Whether there is a step to redo."""
        return bool(self._undone)

    def _move(
        self, scene: Scene, source: list[tuple[Parts, Parts]], target: list[tuple[Parts, Parts]], side: int
    ) -> Scene:
        self._going_on = False
        if not source:
            return scene
        step = source.pop()
        target.append(step)
        return replace(scene, **step[side])
