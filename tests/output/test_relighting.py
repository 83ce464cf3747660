"""Relighting: sums of scaled layers, from images and files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.errors import SceneError, UsageError
from clrt.output.images import read_image
from clrt.scene.model import Scene

SIZE = (5, 7, 3)


def layered(**parts: Any) -> clrt.Image:
    """Return an image of three light groups whose values are fractions of 2¹², so that sums are exact."""
    generator = np.random.default_rng(1)
    groups = {name: generator.integers(0, 4096, SIZE).astype(np.float32) / 4096 for name in ("fill", "key", "default")}
    aovs: dict[str, Any] = {f"light_group.{name}": layer for name, layer in groups.items()}
    aovs["depth"] = np.ones(SIZE[:2], np.float32)
    return clrt.Image(np.sum([*groups.values()], axis=0, dtype=np.float32), aovs=aovs, **parts)


def test_layers_are_scaled_and_added(tmp_path: Path) -> None:
    """By one number or by channels; those not named stay. An .exr has the same as the image in memory."""
    image = layered()
    image.save(tmp_path / "a.exr")
    groups = image.light_groups
    assert list(groups) == ["fill", "key", "default"]
    for source in (image, tmp_path / "a.exr", str(tmp_path / "a.exr")):
        np.testing.assert_array_equal(clrt.relight(source, {}).pixels, image.pixels)
        found = clrt.relight(source, {"key": 0.25, "fill": (2, 1, 0)}).pixels
        expected = 0.25 * groups["key"] + np.array([2, 1, 0]) * groups["fill"] + groups["default"]
        np.testing.assert_array_equal(found, expected)
        assert found.dtype == np.float32


def test_coverage_stays(tmp_path: Path) -> None:
    image = layered(alpha=np.linspace(0, 1, 35, dtype=np.float32).reshape(SIZE[:2]))
    image.save(tmp_path / "a.exr")
    for source in (image, tmp_path / "a.exr"):
        np.testing.assert_array_equal(clrt.relight(source, {"key": 0}).alpha, image.alpha)


def test_mistakes(tmp_path: Path) -> None:
    image = layered()
    with pytest.raises(
        UsageError, match="light group 'kye' is unknown; choose from fill, key, default; did you mean k"
    ):
        clrt.relight(image, {"kye": 1})
    wrong: tuple[Any, ...] = (-1, float("nan"), (1, 2), float("inf"), "half", (1, "x", 2), [[1], []], None, {}, 1j)
    with pytest.raises(UsageError, match="brighter than float32 can store"):
        clrt.relight(image, {"key": 3e38, "fill": 3e38})
    for factor in wrong:
        with pytest.raises(UsageError, match="light group 'key': .* is not a factor; give a number of at least 0"):
            clrt.relight(image, {"key": factor})
    plain = clrt.Image(image.pixels)
    plain.save(tmp_path / "plain.exr")
    for source, name in ((plain, "the image"), (tmp_path / "plain.exr", "plain.exr")):
        with pytest.raises(SceneError, match=f"{name}: has no layers of light groups; render it with the AOV"):
            clrt.relight(source, {})
    with pytest.raises(SceneError, match="absent.exr"):
        clrt.relight(tmp_path / "absent.exr", {})
    (tmp_path / "broken.exr").write_bytes(b"v/1\x01 and no more")
    with pytest.raises(SceneError, match="broken.exr"):
        clrt.relight(tmp_path / "broken.exr", {})


def test_a_render_is_relit_on_the_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A .png gets a file per layer, and those of a scene's textures and other results are not overwritten."""
    from clrt.cli import commands

    monkeypatch.chdir(tmp_path)
    lamp = clrt.PointLight(position=(1, 3, 4), intensity=(40, 30, 20), light_group="key")
    scene = Scene(spheres=[clrt.Sphere()], lights=[lamp], environment=clrt.Environment(color=(0.1, 0.2, 0.3)))
    clrt.save_scene(scene, "ball.toml")

    def run(*arguments: str) -> None:
        commands.main(list(arguments), standalone_mode=False)

    run(
        "render",
        "ball.toml",
        "--size",
        "16x12",
        "--spp",
        "2",
        "-q",
        "--aov",
        "light_groups",
        "-o",
        "a.exr",
        "-o",
        "a.png",
    )
    assert {path.name for path in tmp_path.glob("a*")} == {
        "a.exr",
        "a.png",
        "a.light_group.key.png",
        "a.light_group.default.png",
    }
    image = clrt.render("ball.toml", size=(16, 12), spp=2, aovs="light_groups")
    run("relight", "a.exr", "--group", "key=0", "--group", "default=2,1,0", "-o", "b.exr")
    expected = image.light_groups["default"] * np.array([2, 1, 0], np.float32)
    np.testing.assert_array_equal(read_image("b.exr"), expected)
    run("relight", "a.exr", "-o", "c.png", "--view", "agx", "--exposure", "1")
    assert (tmp_path / "c.png").is_file()
    with pytest.raises(UsageError, match="is the image with the light groups, which would be lost"):
        run("relight", "a.exr", "-o", "./a.exr")
    (tmp_path / "a.light_group.key.png").chmod(0o444)
    with pytest.raises(clrt.OutputError, match="a.light_group.key.png"):
        run("render", "ball.toml", "--size", "16x12", "--spp", "2", "-q", "--aov", "light_groups", "-o", "a.png")
