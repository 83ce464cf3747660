"""Refusal of scenes of which the camera sees something else than what lights and reflects."""

from __future__ import annotations

from ...errors import UsageError
from ...rendering.film.backdrop import sees_environment
from ...scene.editing import materials_of
from ...scene.model import Scene


def check_seen_as_lit(scene: Scene, renderer: str) -> None:
    """Raise UsageError for transparent images, backdrops, catchers and what is hidden from the camera, which are not
    exported to another renderer."""
    hidden = [name for name, material in materials_of(scene).items() if not material.camera_visible]
    if hidden or not sees_environment(scene):
        raise UsageError(
            f"{scene.name}: transparent, backdrop, catcher and camera_visible are not exported to {renderer}; leave "
            "them out"
        )
