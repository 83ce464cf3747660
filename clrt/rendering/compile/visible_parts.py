"""The parts of a scene that its image depends on."""

from __future__ import annotations

from dataclasses import fields

from ...scene.model import Scene

#: Fields of a Scene that are no part of it: names, settings, and what is rendered only when it is chosen.
UNSEEN = {"name", "render", "cameras", "animation", "materials", "source", "display"}


def visible_parts(scene: Scene) -> list[str]:
    """Return the names of the visible parts of a scene."""
    return [field.name for field in fields(scene) if field.name not in UNSEEN]


def same_world(one: Scene, other: Scene) -> bool:
    """Return whether all visible parts but the camera are the identical objects."""
    return all(getattr(one, name) is getattr(other, name) for name in visible_parts(one) if name != "camera")
