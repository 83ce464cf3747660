"""Clicking an object in the image selects it in the panels."""

from __future__ import annotations

from pathlib import Path

from imgui_bundle import imgui

from .driver import Driver, drive
from .scenes import two_balls


def click(window: Driver, x: float, y: float, dragged: float = 0.0) -> None:
    """Click at a point of the 160 x 120 rendered pixels, or drag by `dragged` window pixels to the right."""
    (left, top), (width, height) = window.app.viewport.corner, window.app.viewport.size
    window.context.mouse_move_to_pos((left + width * x / 160, top + height * y / 120))
    if dragged:
        window.context.mouse_drag_with_delta((dragged, 0))
    else:
        window.context.mouse_click()


def test_a_click_chooses_sphere_and_material(tmp_path: Path) -> None:
    def test(window: Driver) -> None:
        def chosen() -> tuple[int, str]:
            return window.app.editor.sphere, window.app.editor.material

        def shown(name: str) -> bool:
            return not window.context.get_window_by_ref(f"//{name}").hidden

        window.rest()
        window.panel("Camera")
        click(window, 119.6, 60)
        window.until(lambda: chosen() == (1, "gold"), "the right ball")
        window.until(lambda: shown("Spheres"), "its panel")
        click(window, 40.4, 60)
        window.until(lambda: chosen() == (0, "red"), "the left ball")
        assert window.live.scene.camera == two_balls().camera and not window.live.can_undo
        window.rest()
        window.picture()

        click(window, 80, 110)
        window.until(lambda: chosen() == (0, "floor"), "the floor, which is no sphere")
        window.until(lambda: shown("Materials"), "its panel")
        click(window, 119.6, 60)
        window.until(lambda: chosen() == (1, "gold"), "the right ball")
        window.context.yield_(3)
        assert shown("Materials"), "it stays, as it shows what was clicked"
        click(window, 80, 5)
        click(window, 40.4, 60, dragged=12.0)
        window.rest()
        window.context.yield_(3)
        assert chosen() == (1, "gold"), "neither the sky nor dragging chooses anything"

        window.panel("Spheres")
        window.context.item_input_value("sphere/radius", 0.2)
        assert [ball.radius for ball in window.live.scene.spheres] == [0.8, 0.2]

        window.panel("Camera")
        click(window, 40.4, 60)
        window.until(lambda: shown("Spheres"), "the panel")
        window.context.key_hold(imgui.Key.w, 0.1)
        assert window.live.scene.camera != two_balls().camera, "the picture has the keyboard still"

    drive(two_balls(), test, tmp_path)
