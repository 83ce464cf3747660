"""The camera: how it is moved, its lens, and bookmarks of places to come back to."""

from __future__ import annotations

from imgui_bundle import imgui

from ..desk import Desk
from ..fields import choose, edit_fields

ABOUT = """In the picture: W A S D walk, Q and E go down and up, Shift is faster.
Dragging with the left button looks around, or orbits; with the middle one it shifts the picture.
The wheel comes nearer."""


class CameraPanel:
    """The panel; `name` is the next bookmark's."""

    def __init__(self) -> None:
        self.name = "bookmark"

    def show(self, desk: Desk) -> None:
        """Draws it."""
        hands, camera = desk.hands, desk.scene.camera
        hands.mode = choose("dragging", ["look", "orbit"], hands.mode)
        imgui.set_item_tooltip(ABOUT)
        _, hands.pace = imgui.slider_float("speed", hands.pace, 0.01, 10, "%.2g", imgui.SliderFlags_.logarithmic.value)
        imgui.set_item_tooltip("What a second of walking covers of the distance to what the camera looks at.")
        imgui.push_id("camera")
        new = edit_fields(camera, desk.step)
        imgui.pop_id()
        if new is not camera:
            desk.edit(camera=new)
        self._bookmarks(desk)

    def _bookmarks(self, desk: Desk) -> None:
        imgui.separator_text("Bookmarks")
        _, self.name = imgui.input_text("##name", self.name)
        imgui.same_line()
        cameras = desk.scene.cameras
        if imgui.button("keep") and self.name:
            desk.edit(cameras={**cameras, self.name: desk.scene.camera})
        for name, camera in cameras.items():
            imgui.push_id(name)
            if imgui.button("go"):
                desk.edit(camera=camera)
            imgui.same_line()
            if imgui.button("forget"):
                desk.edit(cameras={other: kept for other, kept in cameras.items() if other != name})
            imgui.same_line()
            imgui.text(name)
            imgui.pop_id()
