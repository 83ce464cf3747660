"""Files that the window writes and reads."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from clrt.formats.images.image_reader import read_texels
from clrt.formats.load_scene import load
from clrt.output.images import read_image
from clrt.scene.materials.material_types import Diffuse

from .driver import Driver, drive
from .scenes import two_balls


@pytest.mark.programs
def test_what_is_saved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The saved image of an edited scene equals, bit for bit, that of `clrt render` for the saved scene at the same
    number of samples."""
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
        window.until(lambda: "unknown image format .gif" in window.app.editor.message, "a complaint")
        (tmp_path / "locked.png").touch(0o444)
        for what, name in (("picture", "locked.png"), ("screenshot", "locked.png"), ("picture", "no/such.png")):
            window.context.item_input_value(f"{what}/##file", name)
            window.context.item_click(f"{what}/save {what}")
            told = "no/such.png: the folder no does not exist" if "/" in name else "locked.png: is read-only"
            window.until(lambda: told in window.app.editor.message, told)
        assert not (tmp_path / "locked.png").stat().st_size

    drive(two_balls(integrator="path"), test, tmp_path)
    done = subprocess.run(
        [sys.executable, "-m", "clrt", "render", "saved.toml", "--spp", "12", "-o", "again.exr"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert read_image(tmp_path / "saved.exr").tobytes() == read_image(tmp_path / "again.exr").tobytes()
    scene = load(tmp_path / "saved.toml")
    kept, camera = scene.cameras["bookmark"], scene.camera
    assert [kept.position, camera.position] == [(0, 1, 5), (1.5, 1, 5)] and scene.spheres[0].radius == 0.4
    assert list(scene.materials) == ["red", "gold", "floor"]
    assert read_texels(tmp_path / "window.png").shape == (800, 1280, 4)


@pytest.mark.programs
def test_another_scene_is_opened(tmp_path: Path) -> None:
    (tmp_path / "blue.toml").write_text("""
        [render]\nsize = [160, 120]\nspp = 2\nintegrator = "albedo"
        [materials.blue]\ntype = "diffuse"\ncolor = [0.1, 0.2, 0.9]
        [[sphere]]\nmaterial = "blue"\nradius = 0.3\n""")

    def test(window: Driver) -> None:
        window.rest()
        window.panel("File")
        window.context.item_input_value("##other", str(tmp_path / "green.toml"))
        window.context.item_click("open")
        window.until(lambda: "green.toml" in window.app.editor.message, "a complaint")
        window.context.item_input_value("##other", str(tmp_path / "blue.toml"))
        window.context.item_click("open")
        window.until(lambda: window.live.scene.name == "blue", "the other scene")
        window.rest()
        picture = window.picture()
        assert picture[310, 413].argmax() == 2 and not picture[5].any()
        assert window.app.editor.materials == {"blue": Diffuse(color=(0.1, 0.2, 0.9))}
        window.live.undo()
        assert window.live.scene.name == "two balls"
        window.rest()

    drive(two_balls(), test, tmp_path)
