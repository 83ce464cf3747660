"""Camera navigation by keyboard and mouse: keys walk, dragging looks around or orbits, the wheel zooms."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

from imgui_bundle import imgui

from ..scene.model import Camera
from .navigation import approached, distance, has_axes, orbited, shifted, turned, walked

#: Keys, and the direction in which they walk: right, up, forward.
KEYS = {
    imgui.Key.d: (1, 0, 0),
    imgui.Key.a: (-1, 0, 0),
    imgui.Key.e: (0, 1, 0),
    imgui.Key.q: (0, -1, 0),
    imgui.Key.w: (0, 0, 1),
    imgui.Key.s: (0, 0, -1),
}
#: Speed factor with Shift.
FASTER = 5.0
#: Factor of the distance per notch of the wheel.
NOTCH = 0.9
#: Seconds per frame that count at most, so that a slow frame does not cause a jump.
LONGEST = 0.1


@dataclass
class CameraControls:
    """mode: the effect of dragging, "look" or "orbit"; pace: walking speed per second, relative to
    the distance to the look_at point."""

    mode: str = "look"
    pace: float = 0.5

    def move(self, camera: Camera, height: float) -> Camera:
        """Return the camera after this frame's keyboard and mouse input; the same object if it did not move. ImGui's
        last item must be the image, `height` pixels high."""
        if not has_axes(camera):
            return camera
        if imgui.is_item_hovered() or imgui.is_item_active():
            camera = self._mouse(camera, height)
        typing = imgui.get_io().want_text_input
        return camera if typing or not imgui.is_window_focused() else self._keys(camera)

    def _mouse(self, camera: Camera, height: float) -> Camera:
        io, (dx, dy) = imgui.get_io(), imgui.get_io().mouse_delta
        if io.mouse_wheel:
            camera = approached(camera, NOTCH**io.mouse_wheel)
        if not imgui.is_item_active() or not (dx or dy):
            return camera
        if imgui.is_mouse_down(imgui.MouseButton_.middle.value):
            return shifted(camera, -dx / height, dy / height)
        degrees = camera.fisheye_degrees if camera.projection == "fisheye" else camera.fov_degrees
        angle = radians(degrees) / height
        return turned(camera, dx * angle, dy * angle) if self.mode == "look" else orbited(camera, dx / 100, dy / 100)

    def _keys(self, camera: Camera) -> Camera:
        io = imgui.get_io()
        pressed = [way for key, way in KEYS.items() if imgui.is_key_down(key)]
        if not pressed or io.key_ctrl or io.key_alt:
            return camera
        step = self.pace * distance(camera) * min(io.delta_time, LONGEST) * (FASTER if io.key_shift else 1)
        right, up, forward = (step * sum(way) for way in zip(*pressed))
        return walked(camera, right, up, forward)
