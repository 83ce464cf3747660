"""Camera panel: navigation, lens, and bookmarks."""

from __future__ import annotations

from imgui_bundle import imgui

from ..editor import Editor
from ..fields import choose

ABOUT = """In the image: W A S D to walk, Q and E to move down and up, Shift to move faster.
Drag with the left button to look around or orbit, with the middle button to pan.
Scroll to move closer or farther."""


class CameraPanel:
    """The panel; `name` is the name of the next bookmark."""

    def __init__(self) -> None:
        self.name = "bookmark"

    def show(self, editor: Editor) -> None:
        """Draw the panel."""
        controls, camera = editor.controls, editor.scene.camera
        controls.mode = choose("dragging", ["look", "orbit"], controls.mode)
        imgui.set_item_tooltip(ABOUT)
        _, controls.pace = imgui.slider_float(
            "speed", controls.pace, 0.01, 10, "%.2g", imgui.SliderFlags_.logarithmic.value
        )
        imgui.set_item_tooltip("Walking speed per second, relative to the distance to the look-at point.")
        imgui.push_id("camera")
        new = editor.edited(camera, without={"end"})
        imgui.pop_id()
        if new is not camera:
            editor.edit(camera=new)
        self._bookmarks(editor)

    def _bookmarks(self, editor: Editor) -> None:
        imgui.separator_text("Bookmarks")
        _, self.name = imgui.input_text("##name", self.name)
        imgui.same_line()
        cameras = editor.scene.cameras
        if imgui.button("keep") and self.name:
            editor.edit(cameras={**cameras, self.name: editor.scene.camera})
        for name, camera in cameras.items():
            imgui.push_id(name)
            if imgui.button("go"):
                editor.edit(camera=camera)
            imgui.same_line()
            if imgui.button("forget"):
                editor.edit(cameras={other: kept for other, kept in cameras.items() if other != name})
            imgui.same_line()
            imgui.text(name)
            imgui.pop_id()
