"""File panel: opens another scene, and saves the image, the scene and a screenshot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from imgui_bundle import imgui

from ..editor import Editor


class Files:
    """The panel; `names`: output files, by what is written to them; `other`: the file to open."""

    def __init__(self) -> None:
        self.names: dict[str, str] = {}
        self.other, self._stem = "", ""

    def show(self, editor: Editor) -> None:
        """Draw the panel."""
        if (stem := editor.scene.name) != self._stem:
            self._stem = stem
            self.names = {"picture": f"{stem}.png", "scene": f"{stem}.edited.toml", "screenshot": f"{stem}.window.png"}
        _, self.other = imgui.input_text_with_hint("##other", "a scene or model", self.other)
        imgui.same_line()
        if imgui.button("open") and self.other:
            editor.open(Path(self.other))
        actions: dict[str, Callable[[Path], None]] = {
            "picture": editor.save_picture,
            "scene": editor.save_scene,
            "screenshot": editor.save_screenshot,
        }
        for what, write in actions.items():
            imgui.push_id(what)
            _, self.names[what] = imgui.input_text("##file", self.names[what])
            imgui.same_line()
            if imgui.button(f"save {what}"):
                write(Path(self.names[what]))
            imgui.pop_id()
        imgui.separator_text("Steps")
        live = editor.live
        for name, can, take in (("undo", live.can_undo, live.undo), ("redo", live.can_redo, live.redo)):
            imgui.begin_disabled(not can)
            if imgui.button(name):
                take()
            imgui.end_disabled()
            imgui.same_line()
        imgui.new_line()
