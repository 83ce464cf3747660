"""Viewport: the image in the window, as large as fits, with camera navigation."""

from __future__ import annotations

from math import floor

from imgui_bundle import ImVec2, hello_imgui, imgui

from ..errors import ObjectError
from .editor import Editor
from .tone_mapping import ToneMapped

LEFT = imgui.MouseButton_.left.value
ANY_BUTTON = (
    imgui.ButtonFlags_.mouse_button_left.value
    | imgui.ButtonFlags_.mouse_button_middle.value
    | imgui.ButtonFlags_.mouse_button_right.value
)


class Viewport:
    """Viewport panel. shown: the displayed image; corner and size: its position in the window, in window pixels."""

    def __init__(self) -> None:
        self.shown: ToneMapped | None = None
        self.corner, self.size = (0, 0), (1, 1)
        self._texture: hello_imgui.TextureGpu | None = None

    def show(self, editor: Editor) -> None:
        """Draw the image, and move the camera by keyboard and mouse."""
        newest = editor.tone_mapper.newest
        if newest is not None and newest is not self.shown:
            self.shown, self._texture = newest, hello_imgui.create_texture_gpu_from_rgba_data(newest.rgba)
        self._place(editor.scene.render.size)
        if imgui.invisible_button("picture", self.size, ANY_BUTTON):
            self._clicked(editor)
        if self._texture is not None:
            end = self.corner[0] + self.size[0], self.corner[1] + self.size[1]
            imgui.get_window_draw_list().add_image(imgui.ImTextureRef(self._texture.texture_id()), self.corner, end)
        try:
            camera = editor.controls.move(editor.scene.camera, self.size[1])
        except ObjectError as problem:  # it would look along its up vector, or stand at the look-at point
            editor.message = str(problem)
            return
        if camera is not editor.scene.camera:
            editor.walk(camera)

    def _clicked(self, editor: Editor) -> None:
        """Pick what is under a click; ignore the end of a drag."""
        if imgui.is_mouse_released(LEFT) and not any(imgui.get_mouse_drag_delta(LEFT)):
            at = imgui.get_mouse_pos()
            editor.pick((at.x - self.corner[0]) / self.size[0], (at.y - self.corner[1]) / self.size[1])

    def release(self) -> None:
        """Release the GPU texture, which must be done while the window exists."""
        self._texture = None

    def _place(self, size: tuple[int, int]) -> None:
        """Compute whole window pixels, centered in the available space, for an image of this aspect ratio."""
        start, room = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail()
        factor = max(min(room.x / size[0], room.y / size[1]), 1 / min(size))
        self.size = max(1, floor(size[0] * factor)), max(1, floor(size[1] * factor))
        self.corner = (
            floor(start.x + max(room.x - self.size[0], 0) / 2),
            floor(start.y + max(room.y - self.size[1], 0) / 2),
        )
        imgui.set_cursor_screen_pos(ImVec2(*self.corner))
