"""The window shows the rendered image, and the camera moves and looks around."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from imgui_bundle import imgui

from clrt.output.view_transform import to_display

from .driver import Driver, changed, drive, halves
from .scenes import two_balls


def test_it_shows_what_is_rendered(tmp_path: Path) -> None:
    """The center of each pixel has its own color, other places one between its neighbors'."""

    def test(window: Driver) -> None:
        levels = to_display(window.rest().pixels).astype(np.int16)
        picture = window.picture()
        height, width = picture.shape[:2]
        rows, columns = ((np.arange(size) + 0.5) * height / 120 for size in (120, 160))
        shown = picture[rows.astype(int)][:, columns.astype(int)]
        assert (height, width) == (620, 827), "as large as fits"
        assert np.mean(np.abs(shown - levels)) < 2 and np.median(np.abs(shown - levels)) <= 1

    drive(two_balls(), test, tmp_path)


def test_walking_and_looking(tmp_path: Path) -> None:
    def test(window: Driver) -> None:
        window.rest()
        before, start = window.picture(), window.live.scene.camera
        window.panel("Picture")
        window.context.key_hold(imgui.Key.w, 0.3)
        window.rest()
        walked, camera = window.picture(), window.live.scene.camera
        assert camera.position[0] == 0 and camera.position[1] == 1 and 0 < camera.position[2] < start.position[2] - 0.2
        assert camera.look_at[2] - camera.position[2] == pytest.approx(-5), "what it looks at moves along"
        assert min(halves(changed(before, walked))) > 0.1, "both balls grow"
        assert not changed(before, walked)[:20].any(), "the sky stays"
        assert not window.live.can_undo, "a walk is no step"

        (x, y), (width, height) = window.app.viewport.corner, window.app.viewport.size
        window.context.mouse_move_to_pos((x + width / 2, y + height / 2))
        window.context.mouse_drag_with_delta((height / 4, 0))
        window.rest()
        looked, turned = window.picture(), window.live.scene.camera
        assert turned.position == camera.position
        angle = np.degrees(np.arctan2(turned.look_at[0], camera.position[2] - turned.look_at[2]))
        assert angle == pytest.approx(10, abs=0.2), "a quarter of the field of view, to the right"
        assert min(halves(changed(walked, looked))) > 0.1

    drive(two_balls(), test, tmp_path)
