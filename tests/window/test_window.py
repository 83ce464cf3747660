"""The window, driven as a user would: what each action changes in its picture, and what it does not."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from imgui_bundle import imgui
from numpy.typing import NDArray

from clrt.output.images import read_image
from clrt.output.view import to_display
from clrt.scene.file import load
from clrt.scene.material import SHARED
from clrt.scene.materials import MATERIALS, Diffuse
from clrt.scene.pictures import read_texels
from clrt.scene.presets import CONDUCTORS
from clrt.scene.textures import WHITE, Texture

from .driver import Driver, Levels, drive
from .scenes import SKY, two_balls


def changed(before: Levels, after: Levels) -> NDArray[np.bool_]:
    """(height, width): where two pictures differ by more than the rounding of a level."""
    return np.asarray(np.abs(before - after).max(axis=2) > 1)


def halves(mask: NDArray[np.bool_]) -> tuple[float, float]:
    """The part of the left half that is set, and that of the right half."""
    middle = mask.shape[1] // 2
    return float(mask[:, :middle].mean()), float(mask[:, middle:].mean())


def at(picture: Levels, x: float, y: float) -> list[int]:
    """The colour at a point of the 160 x 120 pixels that were rendered."""
    height, width = picture.shape[:2]
    return [int(level) for level in picture[int(y / 120 * height), int(x / 160 * width)]]


def test_it_shows_what_is_rendered(tmp_path: Path) -> None:
    """In the middle of each pixel its own colour, everywhere else one between its neighbours'."""
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


def test_a_material_gets_a_preset(tmp_path: Path) -> None:
    def test(window: Driver) -> None:
        window.rest()
        before = window.picture()
        window.panel("Materials")
        window.choose("##material", "gold")
        window.choose("material/preset", "copper")
        window.rest()
        copper = window.picture()
        left, right = halves(changed(before, copper))
        assert left == 0 and 0.1 < right < 0.3, "the right ball alone"
        gold, dull = at(before, 116, 52), at(copper, 116, 52)
        assert dull[2] > gold[2] and dull[1] < gold[1], "of copper's light more is blue, and less green (table of F0)"

        window.choose("material/type", "mirror")
        window.rest()
        mirror = window.picture()
        left, right = halves(changed(copper, mirror))
        assert left == 0 and 0.1 < right < 0.3
        sky = 0.8 * np.array([[SKY]], np.float32)   # both types have a color, which stays
        assert at(mirror, 116, 36) == pytest.approx(to_display(sky)[0, 0].tolist(), abs=1), "its top reflects the sky"
        assert window.live.scene.materials["gold"] is window.live.scene.spheres[1].material

    drive(two_balls(), test, tmp_path)


def test_every_parameter_can_be_edited(tmp_path: Path) -> None:
    """The panel has a widget for each field of each type of material, by its name."""
    def test(window: Driver) -> None:
        window.rest()
        window.panel("Materials")
        window.context.item_open("material/emission, normal map, opacity")
        for kind in MATERIALS:
            window.choose("material/type", kind.kernel)
            window.context.yield_(2)
            assert type(window.live.scene.materials["red"]) is kind
            for field in fields(kind):
                shared = "emission, normal map, opacity/" if field.name in SHARED else ""
                widgets = (field.name, f"##{field.name} given", f"{field.name}/##X", f"{field.name}/$$0")
                found = any(window.context.item_exists(f"material/{shared}{widget}") for widget in widgets)
                assert found or field.name == "normal_map", f"{kind.kernel}.{field.name}"

    drive(two_balls(), test, tmp_path)


def test_what_need_not_be_given(tmp_path: Path) -> None:
    """Numbers that go together come together, from the preset, and go together; a texture has its own fields."""
    def test(window: Driver) -> None:
        def gold() -> Any:
            return window.live.scene.materials["gold"]

        def tick(item: str) -> None:
            window.context.item_click(item)
            window.context.yield_(2)

        window.rest()
        window.panel("Materials")
        window.choose("##material", "gold")
        window.choose("material/substance", "copper (conductor)")
        tick("material/##eta given")
        assert (gold().eta, gold().k) == CONDUCTORS["copper"]
        tick("material/##k given")
        assert gold().eta is gold().k is None and gold().preset == "copper"
        tick("material/##eta given")
        window.context.item_input_value("material/eta/$$1", 0.25)
        assert gold().eta == (CONDUCTORS["copper"][0][0], 0.25, CONDUCTORS["copper"][0][2])

        window.choose("##material", "floor")
        window.context.item_open("material/color")
        window.context.item_input_value("material/color/scale/$$0", 3)
        window.choose("material/color/wrap[1]", "clamp")
        color = window.live.scene.meshes[0].material.color  # type: ignore[attr-defined]
        assert (color.scale, color.wrap, color.picture) == ((3, 1), ("repeat", "clamp"), WHITE)

    scene = two_balls(integrator="normals", spp=1)
    floor = Diffuse(color=Texture(picture=WHITE))
    scene.meshes[0].uv, scene.meshes[0].material = np.zeros((4, 2), np.float32), floor
    scene.materials["floor"] = floor
    drive(scene, test, tmp_path)


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


def test_integrators_are_switched(tmp_path: Path) -> None:
    def test(window: Driver) -> None:
        window.rest()
        local = window.picture()
        window.panel("Render")
        window.choose("render/integrator", "normals")
        window.rest()
        normals = window.picture()
        assert at(normals, 80, 5) == [0, 0, 0], "the sky has no normal"
        assert at(normals, 80, 110) == pytest.approx([128, 255, 128], abs=1), "the floor's is +y"
        towards = [127.5 * (1 + part / np.hypot(1.2, 5)) for part in (-1.2, 0, 5)]
        assert at(normals, 119.6, 60) == pytest.approx(towards, abs=3), "the middle of a ball's is towards the camera"

        window.choose("render/integrator", "raster")
        window.rest()
        raster = window.picture()
        assert changed(local, raster).mean() < 0.02, "rays see the same, but for edges"

        window.choose("render/integrator", "path")
        window.rest()
        path = window.picture()
        assert min(halves(changed(local, path))) > 0.2
        assert not changed(local, path)[:20].any(), "the sky is the same"
        assert at(path, 92, 98)[0] > at(local, 92, 98)[0], "between the balls falls red light"

        window.context.item_input_value("render/max_depth", 1)
        window.rest()
        dark = window.picture()
        assert at(dark, 80, 110) == at(dark, 44, 60) == [0, 0, 0], "nothing but what glows"
        assert not changed(path, dark)[:20].any()

        window.context.item_input_value("render/exposure", 1.0)
        window.until(lambda: window.app.viewport.shown.look.exposure == 1, "a lighter picture")  # type: ignore
        expected = to_display(np.array([[SKY]], np.float32), exposure=1)[0, 0]
        assert at(window.picture(), 80, 5) == pytest.approx(expected.tolist(), abs=1)

    drive(two_balls(), test, tmp_path)


def test_devices_are_switched(tmp_path: Path) -> None:
    program = f"import sys; sys.path.append('.'); from tests.window.two_devices import main; main({str(tmp_path)!r})"
    done = subprocess.run([sys.executable, "-P", "-c", program], cwd=Path(__file__).parents[2], capture_output=True,
                          text=True, env=os.environ | {"POCL_DEVICES": "pthread basic"})
    assert done.returncode == 0, done.stdout + done.stderr


def test_what_is_saved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The picture of an edited scene is to the last bit what `clrt render` makes of the scene that was saved with it,
    with as many samples."""
    monkeypatch.chdir(tmp_path)

    def test(window: Driver) -> None:
        window.rest()
        window.panel("Spheres")
        window.context.item_input_value("sphere/radius", 0.4)
        window.panel("Camera")
        window.context.item_click("keep")
        window.context.item_input_value("camera/position/$$0", 1.5)
        window.panel("Render")
        window.context.item_input_value("render/spp", 12)
        window.rest()
        window.picture()
        window.panel("File")
        for what, name in (("picture", "saved.exr"), ("scene", "saved.toml"), ("screenshot", "window.png")):
            window.context.item_input_value(f"{what}/##file", name)
            window.context.item_click(f"{what}/save {what}")
            window.until(lambda: window.app.editor.message == f"{name} is written", name)
        window.context.item_input_value("picture/##file", "saved.gif")
        window.context.item_click("picture/save picture")
        window.until(lambda: "unknown picture format .gif" in window.app.editor.message, "a complaint")

    drive(two_balls(integrator="path"), test, tmp_path)
    done = subprocess.run([sys.executable, "-m", "clrt", "render", "saved.toml", "--spp", "12", "-o", "again.exr"],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert read_image(tmp_path / "saved.exr").tobytes() == read_image(tmp_path / "again.exr").tobytes()
    scene = load(tmp_path / "saved.toml")
    kept, camera = scene.cameras["bookmark"], scene.camera
    assert [kept.position, camera.position] == [(0, 1, 5), (1.5, 1, 5)] and scene.spheres[0].radius == 0.4
    assert list(scene.materials) == ["red", "gold", "floor"]
    assert read_texels(tmp_path / "window.png").shape == (800, 1280, 4)


@pytest.mark.parametrize("before, options, environment, code, message", [
    ("", [], {"DISPLAY": ""}, 6, "neither DISPLAY nor WAYLAND_DISPLAY is set"),
    ("", [], {"DISPLAY": ":4711"}, 6, "no window can be opened"),
    ("sys.modules['imgui_bundle'] = None; ", [], {}, 2, "pip install 'clrt[view]'"),
    ("", ["--integrator", "pth"], {}, 2, 'did you mean "path"?'),
    ("", ["--view", "agy"], {}, 2, "did you mean agx?"),
    ("", ["--device", "abacus"], {}, 4, "no usable device matches")],
    ids=["none", "dead", "extra", "integrator", "view", "device"])
def test_what_is_missing_or_wrong_is_said(tmp_path: Path, before: str, options: list[str], environment: dict[str, str],
                                          code: int, message: str) -> None:
    (tmp_path / "ball.toml").write_text('[materials.a]\ntype = "diffuse"\n[[sphere]]\nmaterial = "a"\n')
    program = f"import sys; {before}from clrt.cli import main; main(['view', 'ball.toml', *{options}])"
    done = subprocess.run([sys.executable, "-P", "-c", program], cwd=tmp_path, capture_output=True, text=True,
                          env=os.environ | environment)
    assert done.returncode == code and message in done.stderr and "Traceback" not in done.stderr, done.stderr


INTERRUPTED = """
import os, signal
from clrt.cli import main
from clrt.window.editor import Editor
frame = Editor.frame
def with_interrupt(editor):
    frame(editor)
    if editor.frames == 5:
        os.kill(os.getpid(), signal.SIGINT)
Editor.frame = with_interrupt
main(["view", "ball.toml", "--spp", "2", "--depth", "3", "--view", "agx", "--exposure", "1"])
"""


def test_the_command_ends_with_an_interrupt(tmp_path: Path) -> None:
    (tmp_path / "ball.toml").write_text('[render]\nsize = [32, 24]\n[materials.a]\ntype = "diffuse"\n[[sphere]]\n'
                                        'material = "a"\n[environment]\ncolor = [1, 1, 1]\n')
    done = subprocess.run([sys.executable, "-P", "-c", INTERRUPTED], cwd=tmp_path, capture_output=True, text=True,
                          env=os.environ | {"HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path / ".config")})
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")
    assert (tmp_path / ".config" / "clrt" / "window.ini").is_file(), "where its panels are is remembered"
