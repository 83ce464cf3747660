"""The look of bare models: which lights, ground and view they are given, and that a written scene file keeps them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.errors import SceneError, UsageError
from clrt.formats.load_scene import load
from clrt.output.scenes import save_scene
from clrt.scene.default_sky import SUN, default_sky
from clrt.scene.model import Display, Ground

from ..covering import others

BOX = "".join(f"v {x} {y} {z}\n" for x in (0, 2) for y in (1, 2) for z in (0, 1)) + (
    "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n"
)


@pytest.fixture
def box(tmp_path: Path) -> Path:
    """A box of 2 by 1 by 1 whose lowest side is at a height of 1."""
    (tmp_path / "box.obj").write_text(BOX)
    return tmp_path / "box.obj"


def is_sky(scene: clrt.Scene) -> bool:
    return np.array_equal(np.asarray(scene.environment.image), np.asarray(default_sky().image))


def same_image(one: clrt.Scene, other: clrt.Scene, **options: Any) -> bool:
    images = [clrt.render(scene, size=(24, 16), spp=2, **options).pixels for scene in (one, other)]
    return bool((images[0] == images[1]).all())


def test_the_default_is_a_studio(box: Path) -> None:
    scene = load(box)
    ground = scene.ground
    assert isinstance(ground, Ground) and 0.99 < ground.height < 1 and ground.center == (1.0, 0.5)
    assert ground.radius == pytest.approx(1.5 * np.sqrt(6))
    (key,) = scene.lights
    assert isinstance(key, clrt.DirectionalLight) and key.angle_degrees == 50
    assert scene.display == Display(view="pbr_neutral") and len(scene.meshes) == 1
    assert scene.source is not None and scene.source.contents["look"] == ["studio"]


def test_sky_and_none(box: Path) -> None:
    sky, none = load(box, look="sky"), load(box, look="none")
    assert sky.lights == [SUN] and is_sky(sky) and sky.ground is None
    assert none.lights == [] and none.environment.image is None and not any(none.environment.color)
    assert none.ground is None and not clrt.render(none, size=(8, 8), spp=1).pixels.any()


def test_a_file_with_lights_keeps_these_under_the_sky(tmp_path: Path) -> None:
    (tmp_path / "lit.usda").write_text(
        '#usda 1.0\n(\n upAxis = "Y"\n metersPerUnit = 1\n)\n'
        'def Mesh "m"\n{\n int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [0, 1, 2]\n'
        " point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n}\n"
        'def DistantLight "l"\n{\n float inputs:intensity = 3\n}\n'
    )
    for look in (None, "sky", "studio", "none"):
        scene = load(tmp_path / "lit.usda", look=look)
        (light,) = scene.lights
        assert isinstance(light, clrt.DirectionalLight) and 0 < light.irradiance[0] < 1 and scene.ground is None
        assert (scene.environment.image is None) == (look == "none")
    assert is_sky(load(tmp_path / "lit.usda"))


@pytest.mark.parametrize("look", ["studio", *others("sky", "none")])
@pytest.mark.parametrize("view", [None, "left"])
def test_a_written_scene_renders_the_same_and_is_shown_the_same(look: Any, view: str | None, box: Path) -> None:
    scene = load(box, view, look=look, size=(24, 16))
    save_scene(scene, box.with_name("scene.toml"))
    again = load(box.with_name("scene.toml"))
    assert (again.ground, again.display, again.render) == (scene.ground, scene.display, scene.render)
    assert same_image(scene, again) and same_image(scene, again, transparent=True)
    text = box.with_name("scene.toml").read_text()
    assert ('sky = "studio"' in text) == ("[ground]" in text) == (look == "studio")


def test_the_studio_is_placed_around_the_camera(box: Path) -> None:
    """A view from the left shows light and shadow as the front view of the model turned the other way does."""
    turned = box.with_name("turned.obj")
    rows = np.array([line.split()[1:] for line in BOX.splitlines()[:8]], float)[:, [2, 1, 0]] * [-1, 1, 1]
    lines = ["v {} {} {}".format(*row) for row in rows.tolist()] + BOX.splitlines()[8:]
    turned.write_text("\n".join(lines) + "\n")
    one, other = (
        clrt.render(load(path, view), size=(32, 32), spp=64).pixels for path, view in ((box, "right"), (turned, None))
    )
    assert abs(one.mean() - other.mean()) < 2e-3 * one.mean()
    assert np.abs(one - other).mean() < 0.02


def test_scene_files_and_unknown_looks_are_refused(box: Path) -> None:
    with pytest.raises(UsageError, match="look 'stage' is unknown|look.*stage"):
        load(box, look="stage")  # type: ignore[arg-type]
    save_scene(load(box), box.with_name("scene.toml"))
    with pytest.raises(UsageError, match="scene.toml: look is for model files"):
        load(box.with_name("scene.toml"), look="sky")
    with pytest.raises(UsageError, match=r"size"):
        load(box, size=(0, 5))


@pytest.mark.parametrize(
    "text, fault",
    [
        ('[environment]\nsky = "studi"', r'environment.sky: "studi" is unknown; did you mean "studio"'),
        ("[ground]\nradius = 0", "ground.radius: 0 is not above 0"),
        ("[ground]\ncolor = [2, 0, 0]", r"ground.color\[0\]: 2 is above 1"),
        ("ground = 3", r"ground: 3 is not a table; write \[ground\]"),
        ('[display]\nview = "agxx"', r'display.view: "agxx" is unknown|display.view: "agxx"'),
        ("[display]\nvew = 1", 'display: key "vew" is unknown; did you mean "view"'),
    ],
)
def test_mistakes_in_a_scene_file(text: str, fault: str, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(text + "\n")
    with pytest.raises(SceneError, match=fault):
        load(tmp_path / "scene.toml")


@pytest.mark.parametrize("size", [(64, 64), (160, 60), (60, 160)])
def test_the_camera_frames_the_model_in_the_shape_of_the_image(size: tuple[int, int], box: Path) -> None:
    """The model fills 92 % of the width or of the height, and no more of the other."""
    seen = clrt.render(load(box, look="none", size=size), size=size, spp=64, integrator="normals", transparent=True)
    assert seen.alpha is not None
    covered = [np.flatnonzero(seen.alpha.max(axis=axis) > 0.02) for axis in (0, 1)]
    filled = [(len(cells) - 1) / length for cells, length in zip(covered, size)]
    assert max(filled) == pytest.approx(0.92, abs=0.05) and min(filled) < 0.95
    for cells, length in zip(covered, size):
        assert abs(cells[0] - (length - 1 - cells[-1])) <= 2


def test_a_path_is_framed_in_the_size_of_its_render(box: Path) -> None:
    image = clrt.render(str(box), size=(48, 16), spp=1)
    assert (image.pixels == clrt.render(load(box, size=(48, 16)), spp=1).pixels).all()
    assert (image.pixels != clrt.render(load(box), size=(48, 16), spp=1).pixels).any()


def test_a_png_has_the_view_of_the_scene(box: Path, tmp_path: Path) -> None:
    image = clrt.render(load(box), size=(8, 8), spp=1)
    image.save(tmp_path / "default.png")
    image.save(tmp_path / "neutral.png", view="pbr_neutral")
    image.save(tmp_path / "srgb.png", view="srgb")
    default, neutral, srgb = (clrt.read_image(tmp_path / f"{name}.png") for name in ("default", "neutral", "srgb"))
    assert (default == neutral).all() and (default != srgb).any() and image.report["view"] == "pbr_neutral"


def test_a_render_ends_at_the_error_unless_told_otherwise(box: Path) -> None:
    told = clrt.render(load(box), size=(32, 32)).report
    assert told["stop_reason"] == "error" and told["noise"] <= 0.02 and 2 <= told["spp"] < 128
    told = clrt.render(load(box), size=(32, 32), spp=3).report
    assert told["stop_reason"] == "spp" and told["spp"] == 3
