"""Spheres and lights edited as by a user change the expected parts of the image and no others."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from imgui_bundle import imgui

from clrt.output.view_transform import to_display
from clrt.scene.light_images import LightImage
from clrt.scene.lights import ProjectorLight

from .driver import Driver, at, changed, drive, halves
from .scenes import SKY, two_balls


@pytest.mark.programs
def test_a_sphere_is_edited(tmp_path: Path) -> None:
    def test(window: Driver) -> None:
        window.rest()
        before = window.picture()
        window.panel("Spheres")
        window.context.item_input_value("sphere/radius", 0.5)
        window.rest()
        smaller = window.picture()
        left, right = halves(changed(before, smaller))
        assert left > 0.1 and right == 0
        assert at(before, 44, 40) != at(smaller, 44, 40) == at(before, 80, 40), "where it was is sky now"
        assert window.live.scene.spheres[0].radius == 0.5

        window.context.item_click("//**/1: right")
        window.context.item_click("remove")
        window.rest()
        left, right = halves(changed(smaller, window.picture()))
        assert left == 0 and right > 0.1

        window.context.key_press(imgui.Key.mod_ctrl | imgui.Key.z)
        window.rest()
        assert not changed(smaller, window.picture()).any(), "it is back"
        window.context.key_press(imgui.Key.mod_ctrl | imgui.Key.z)
        window.rest()
        assert not changed(before, window.picture()).any() and not window.live.can_undo

    drive(two_balls(), test, tmp_path)


@pytest.mark.programs
def test_the_light_moves(tmp_path: Path) -> None:
    def test(window: Driver) -> None:
        window.rest()
        before = window.picture()
        window.panel("Lights")
        window.context.item_input_value("light/position/$$0", 3.0)
        window.rest()
        after = window.picture()
        assert window.live.scene.lights[0].position == (3, 5, 3)  # type: ignore[union-attr]
        assert min(halves(changed(before, after))) > 0.1, "light and shadows of all"
        assert not changed(before, after)[:20].any(), "the sky is no surface"
        assert min(at(before, 24, 107)) > max(at(after, 24, 107)) - 40

        window.context.item_check("light/moves")
        window.until(lambda: window.live.scene.lights[0].position[2] < 2, "a part of a circle")  # type: ignore
        window.context.item_uncheck("light/moves")
        x, y, z = window.live.scene.lights[0].position  # type: ignore[union-attr]
        assert y == pytest.approx(5) and np.hypot(x, z) == pytest.approx(np.hypot(3, 3), rel=1e-4)
        window.rest()

        window.context.item_input_value("environment/strength", 0.5)
        window.rest()
        half = 0.5 * np.array(SKY)
        expected = to_display(half.astype(np.float32)[None, None])[0, 0]
        assert at(window.picture(), 80, 5) == pytest.approx(expected.tolist(), abs=1)

    drive(two_balls(), test, tmp_path)


@pytest.mark.programs
def test_the_image_of_a_light_is_placed(tmp_path: Path) -> None:
    """Its mapping can be edited, and it can be left out; its pixels are those of the file."""
    image = LightImage(pixels=np.ones((2, 2, 3), np.float32), name="slide")
    light = ProjectorLight(position=(0, 5, 3), direction=(0, -1, -0.5), intensity=(9, 9, 9), image=image)

    def test(window: Driver) -> None:
        def shown() -> LightImage | None:
            (edited,) = window.live.scene.lights
            assert isinstance(edited, ProjectorLight)
            return edited.image

        window.rest()
        window.panel("Lights")
        window.context.item_open("light/image")
        window.context.item_input_value("light/image/scale/$$0", -1)
        window.choose("light/image/filter", "nearest")
        window.context.item_click("light/image/##wrap given")
        window.context.yield_(2)
        assert shown() == replace(image, scale=(-1, 1), filter="nearest", wrap=("repeat", "repeat"))
        window.context.item_click("light/##image given")
        window.context.yield_(2)
        assert shown() is None
        window.rest()

    drive(replace(two_balls(), lights=[light]), test, tmp_path)
