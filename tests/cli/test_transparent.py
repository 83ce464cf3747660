"""`clrt render --transparent`: files, frames and messages."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image as Pictures

from .test_commands import clrt as called

SCENE = """
[camera]
position = [0, 2, 5]
[environment]
color = [0.5, 0.6, 0.7]
[materials.table]
type = "diffuse"
catcher = true
[materials.red]
type = "diffuse"
color = [0.8, 0.1, 0.1]
[[sphere]]
radius = 0.5
center = [0, 0.5, 0]
material = "red"
[[mesh]]
vertices = [[-9, 0, -9], [-9, 0, 9], [9, 0, 9], [9, 0, -9]]
faces = [[0, 1, 2], [0, 2, 3]]
material = "table"
"""
OPTIONS = ("--size", "48x32", "--spp", "8")


def clrt(scene: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    return called("render", scene, *OPTIONS, *arguments, cwd=scene.parent)


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "a.toml").write_text(SCENE)
    return tmp_path / "a.toml"


def test_files_and_compositing(scene: Path) -> None:
    """A .png and an .exr have the same alpha; over the backdrop of the scene file the same image is opaque."""
    folder = scene.parent
    outputs = "-o", folder / "a.png", "-o", folder / "a.exr"
    assert clrt(scene, "--transparent", *outputs).returncode == 0
    found = np.asarray(oiio.ImageBuf(str(folder / "a.exr")).get_pixels(oiio.FLOAT))
    levels = np.asarray(Pictures.open(folder / "a.png"))
    np.testing.assert_array_equal(levels[..., 3], np.floor(found[..., 3] * 255 + 0.5))
    assert found[..., 3].max() == 1 and 0.05 < np.mean(found[..., 3]) < 0.5
    scene.write_text(SCENE + "[backdrop]\ncolor = [0.2, 0.3, 0.4]\n")
    assert clrt(scene, "-o", folder / "b.exr").returncode == 0
    opaque = np.asarray(oiio.ImageBuf(str(folder / "b.exr")).get_pixels(oiio.FLOAT))
    assert opaque.shape == (32, 48, 3)
    ball = found[..., 3] == 1
    np.testing.assert_allclose(opaque[ball], found[ball][:, :3], atol=1e-6)


def test_resumed_frames(scene: Path) -> None:
    """Numbered files have alpha, and are kept by --resume."""
    frames = scene.parent / "f.png"
    for _ in range(2):
        done = clrt(scene, "--transparent", "--turntable", "2", "--resume", "-o", frames)
        assert done.returncode == 0
    assert done.stdout == ""
    assert Pictures.open(scene.parent / "f_0001.png").mode == "RGBA"


def test_messages(scene: Path) -> None:
    done = clrt(scene, "--transparent", "-o", scene.parent / "a.jpg")
    assert done.returncode == 0 and "a.jpg: .jpg has no alpha, so the image is written over black" in done.stderr
    done = clrt(scene, "-o", scene.parent / "a.png")
    assert done.returncode == 0 and "what catchers catch is not visible on black" in done.stderr
    done = clrt(scene, "--integrator", "local", "-o", scene.parent / "a.png")
    assert done.returncode == 3 and 'render.integrator: "local" does not support catchers' in done.stderr
