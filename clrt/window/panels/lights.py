"""Lights panel: lights without a surface, and the environment."""

from __future__ import annotations

import numpy as np
from imgui_bundle import imgui

from ...scene.fields.field_types import FLOAT32_MAX
from ...scene.lights import LIGHTS, Light, fields_of
from ...scene.model import Camera, Environment
from ..editor import ROUND, Editor
from ..lists import change, pick
from ..navigation import distance

#: Irradiance of a new light at the camera's look_at point.
BRIGHT = 3.0
#: Ratio of its distance from there to its radius, if it has one.
SMALL = 10.0


class Lights:
    """The panel; `chosen` is the index of the light being edited."""

    def __init__(self) -> None:
        self.chosen = 0

    def show(self, editor: Editor) -> None:
        """Draw the panel."""
        scene = editor.scene
        self.chosen = pick("##lights", [light.kernel for light in scene.lights], self.chosen)
        lights, self.chosen = change(scene.lights, self.chosen, _new(scene.camera))
        if lights:
            imgui.push_id("light")
            lights[self.chosen] = self._edited(editor, lights[self.chosen])
            imgui.pop_id()
        if len(lights) != len(scene.lights) or any(new is not old for new, old in zip(lights, scene.lights)):
            editor.edit(lights=lights)
        imgui.separator_text("Environment")
        imgui.push_id("environment")
        environment = _edited_sky(editor)
        imgui.pop_id()
        if environment is not editor.scene.environment:
            editor.edit(environment=environment)

    def _edited(self, editor: Editor, light: Light) -> Light:
        light = editor.edited(light)
        if light.distant:
            return light
        changed, moves = imgui.checkbox("moves", editor.moving_light == self.chosen)
        imgui.set_item_tooltip(f"The light circles around the camera's look-at point once every {ROUND:g} seconds.")
        if changed:
            editor.moving_light = self.chosen if moves else None
        return light


def _new(camera: Camera) -> dict[str, Light]:
    """Return a light of each type to add: above the camera's look_at point, as far away as the camera."""
    far = distance(camera)
    up = np.asarray(camera.up) / np.linalg.norm(camera.up)
    position, down = np.add(camera.look_at, far * up).tolist(), (-up).tolist()
    values = {
        "position": position,
        "direction": down,
        "up": np.subtract(camera.look_at, camera.position).tolist(),
        "irradiance": (BRIGHT,) * 3,
        "intensity": (min(BRIGHT * far**2, FLOAT32_MAX),) * 3,
        "radius": far / SMALL,
        "radiance": (BRIGHT * SMALL**2 / np.pi,) * 3,
    }
    return {kind.kernel: kind(**fields_of(kind, values)) for kind in LIGHTS}


def _edited_sky(editor: Editor) -> Environment:
    """Show widgets for the environment; its color is hidden if it has an image, as it has no effect."""
    environment = editor.scene.environment
    return editor.edited(environment, {"image", "sky"} | ({"color"} if environment.image is not None else set()))
