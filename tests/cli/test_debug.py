"""`clrt debug`: text and JSON output, render options, and errors."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from clrt.cli import debug
from clrt.errors import ClrtError, SceneError, UsageError
from clrt.output.images import read_image

from .test_commands import clrt

SCENE = """
[camera]
position = [0, 1, 4]
[render]
size = [24, 16]
spp = 8
[materials.white]
type = "diffuse"
color = [0.8, 0.7, 0.6]
[[mesh]]
name = "floor"
vertices = [[-9, -1, 9], [9, -1, 9], [9, -1, -9], [-9, -1, -9]]
faces = [[0, 1, 2], [0, 2, 3]]
material = "white"
[[sphere]]
name = "ball"
material = "white"
[[light]]
type = "point"
position = [0, 5, 0]
intensity = [30, 30, 30]
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "ball.toml"
    path.write_text(SCENE)
    return path


def run(*arguments: object) -> Result:
    return CliRunner().invoke(debug.command, [str(each) for each in arguments])


def test_the_default_is_the_pixel_in_the_center(scene: Path) -> None:
    default, named = (
        json.loads(run(scene, *pixel, "--size", "9x6", "--json").output) for pixel in ([], ["--pixel", "4,3"])
    )
    assert default == named and default["pixel"] == [4, 3]


@pytest.mark.programs
def test_it_is_the_pixel_of_the_render(scene: Path) -> None:
    """The values equal those of `clrt render` with the same options."""
    options = (
        "--size",
        "12x10",
        "--seed",
        "7",
        "--depth",
        "3",
        "--spp",
        "16",
        "--filter",
        "tent",
        "--sampler",
        "stratified",
        "--clamp-direct",
        "0.5",
        "--clamp-indirect",
        "0.1",
        "--back-face-culling",
        "camera",
    )
    assert clrt("render", scene, *options, "-o", "r.exr", "-q", cwd=scene.parent).returncode == 0
    pixels = read_image(scene.parent / "r.exr")
    for x, y in ((5, 3), (1, 8)):
        result = clrt("debug", scene, *options, "--pixel", f"{x},{y}", "--json", "--samples", "16", cwd=scene.parent)
        assert (result.returncode, result.stderr) == (0, "")
        found = json.loads(result.stdout)
        assert found["value"] == pytest.approx(pixels[y, x].tolist(), rel=1e-5) and max(found["value"]) > 0
        sums = [
            [
                vertex[part]["contribution"]
                for vertex in sample["vertices"]
                for part in ("emission", "light_sample")
                if vertex[part]
            ]
            for sample in found["samples"]
        ]
        for total, sample in zip(sums, found["samples"], strict=True):
            assert [sum(each) for each in zip(*total)] == pytest.approx(sample["value"], rel=1e-5)


def test_text_lists_the_vertices_and_ends_with_a_summary(scene: Path) -> None:
    result = run(scene, "--pixel", "2,15", "--samples", "2")
    text = result.stdout
    assert result.exit_code == 0
    assert [line[:9] for line in text.splitlines() if line.startswith("sample")] == ["sample 0:", "sample 1:"]
    assert 'mesh "floor", triangle ' in text and 'material "white" (diffuse)' in text and "light[0] (point)" in text
    assert text.splitlines()[-1].startswith("pixel 2,15 of ball, 8 samples: mean ")
    assert ", clamped by 0." not in text
    assert ", clamped by 0." in run(scene, "--pixel", "2,15", "--samples", "2", "--clamp-direct", "0.01").stdout
    summary = run(scene, "--pixel", "2,15", "--samples", "0").stdout
    assert summary.splitlines() == text.splitlines()[-1:]


def test_a_shadow_says_what_casts_it(scene: Path) -> None:
    """The pixel is straight below the sphere, in its shadow."""
    scene.write_text(SCENE.replace("[0, 1, 4]", "[0, -0.5, 4]\nlook_at = [0, -1, 0]"))
    assert 'all 8 shadowed (by sphere "ball")' in run(scene, "--pixel", "12,8", "--samples", "0", "--depth", "2").stdout


@pytest.mark.parametrize(
    ("arguments", "kind", "words"),
    [
        (("ball.toml", "--pixel", "24,0"), UsageError, "pixel 24,0 is outside the image of 24x16"),
        (("ball.toml", "--pixel", "5,16", "--size", "16x8"), UsageError, "Y 0 to 7"),
        (("nope.toml", "--pixel", "0,0"), SceneError, "nope.toml: no such scene file"),
        (("local.toml", "--pixel", "0,0"), UsageError, 'integrator "local" traces no paths; choose path or direct'),
    ],
)
def test_mistakes_end_in_one_message(
    scene: Path, arguments: tuple[str, ...], kind: type[ClrtError], words: str
) -> None:
    scene.with_name("local.toml").write_text(SCENE.replace("spp = 8", 'spp = 8\nintegrator = "local"'))
    result = run(scene.with_name(arguments[0]), *arguments[1:])
    assert isinstance(result.exception, kind) and words in str(result.exception) and result.stdout == ""


def test_a_pixel_is_two_numbers(scene: Path) -> None:
    for wrong in ("5", "5;6", "a,b", "-1,0"):
        result = run(scene, f"--pixel={wrong}")
        assert result.exit_code == 2 and f"'{wrong}' is not a pixel; write X,Y" in result.stderr
