"""Khronos' fidelity scenarios and other path tracers, tested on a fake suite whose images are known."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import PIL.Image
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray

from clrt.bench.renderers import render_fidelity
from clrt.bench.renderers.fidelity_suite import (
    GENERATOR,
    golden,
    lanczos,
    orbit_camera,
    over_white,
    reduced,
    scenarios,
    shrunk,
    tone_mapped,
)
from clrt.bench.renderers.render_fidelity import judge, verdict
from clrt.cli.bench_render_fidelity import render_fidelity_command
from clrt.errors import UsageError
from clrt.formats.images.image_reader import linear_from_srgb
from clrt.output.image import Image
from clrt.output.view_transform import srgb

from ..formats.glb import Gltf

pytestmark = pytest.mark.needs("flip_evaluator")
SIZE = 32
#: A black wall that fills the left half of the image, and the radiance that it emits.
COLOR = [0.5, 0.25, 0.75]
WALL = np.array([[-9, -9, 0], [0, -9, 0], [0, 9, 0], [-9, 9, 0]], np.float32)


def suite(folder: Path, skybox: bool = False) -> Path:
    """Create a checkout with one scenario: an emissive wall in front of an environment of radiance 1."""
    generator = folder / GENERATOR
    for place in ("test", "environments", "models"):
        (generator / place).mkdir(parents=True)
    gltf = Gltf()
    gltf.document["materials"] = [
        {
            "name": "glow",
            "emissiveFactor": COLOR,
            "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 1},
        }
    ]
    gltf.mesh(
        attributes={"POSITION": gltf.accessor(WALL)},
        material=0,
        indices=gltf.accessor(np.array([0, 1, 2, 0, 2, 3]), "<u2"),
    )
    gltf.write(generator / "models" / "wall.glb")
    Image(np.ones((8, 16, 3), np.float32)).save(generator / "environments" / "sky.hdr")
    (generator / "test" / "config.json").write_text(
        json.dumps(
            {
                "scenarios": [
                    {
                        "name": "wall",
                        "model": "../../../models/wall.glb",
                        "lighting": "../../../environments/sky.hdr",
                        "renderSkybox": skybox,
                        "orbit": {"radius": 4},
                        "dimensions": {"width": 64, "height": 64},
                    }
                ]
            }
        )
    )
    return folder


def expected(skybox: bool) -> NDArray[np.float32]:
    """Return the displayed linear image at twice the size: the wall, then white or the environment."""
    wall, sky = tone_mapped(np.array([[COLOR, [1.0, 1.0, 1.0]]]))[0]
    image = np.broadcast_to(sky if skybox else 1.0, (2 * SIZE, 2 * SIZE, 3)).astype(np.float32)
    image[:, :SIZE] = wall
    return image


def write(folder: Path, renderer: str, image: NDArray[np.float32], website: bool = False) -> None:
    """Write an image as the suite's own PNG or as the website's WebP."""
    place = (folder / "public" / "thumbnails" if website else folder / GENERATOR / "test") / "goldens" / "wall"
    place.mkdir(parents=True, exist_ok=True)
    path = place / f"{renderer}-golden.png"
    Image(image).save(path)
    if website:
        import imageio.v3 as imageio

        imageio.imwrite(path.with_name(f"{renderer}-golden.thumb.webp"), imageio.imread(path), lossless=True)


@pytest.mark.parametrize("skybox", [False, True])
@pytest.mark.parametrize("change", [1.0, 0.7])
def test_what_is_inside_of_the_spread(tmp_path: Path, skybox: bool, change: float) -> None:
    """Two path tracers have slightly different walls; clrt's is between them, or both others are darker."""
    folder = suite(tmp_path, skybox)
    for renderer, factor, website in (("stellar", 0.95 * change, False), ("three-gpu-pathtracer", 1.05 * change, True)):
        image = expected(skybox)
        image[:, :SIZE] *= factor
        write(folder, renderer, image, website)
    (judged,) = judge(scenarios(folder), SIZE, 8)
    row = judged.row
    assert row["result"] == ("inside" if change == 1 else "outside"), row
    wall = tone_mapped(np.array([COLOR]))[0] @ [0.2126, 0.7152, 0.0722]
    means = row["means"]["glow"]
    assert means["clrt"] == pytest.approx(wall, rel=0.01)
    assert means["stellar"] == pytest.approx(0.95 * change * wall, rel=0.02)
    assert row["strayed"] == ([] if change == 1 else ["", "glow"]) and len(judged.images) == 3


def test_an_image_alone_and_what_is_missing(tmp_path: Path) -> None:
    folder = suite(tmp_path)
    with pytest.raises(UsageError, match="has no image by blender-cycles"):
        scenarios(folder)
    write(folder, "stellar", expected(False))
    (judged,) = judge(scenarios(folder), SIZE, 1)
    assert judged.row["result"] == "no spread" and judged.row["flip"]["stellar"] < 0.05
    (folder / GENERATOR / "models" / "wall.glb").write_bytes(b"glTF")
    assert next(judge(scenarios(folder), SIZE, 1)).row["result"] == "not read"
    (folder / GENERATOR / "environments" / "sky.hdr").unlink()
    assert next(judge(scenarios(folder), SIZE, 1)).row["problems"] == [
        str(folder / GENERATOR / "environments" / "sky.hdr")
    ]
    (folder / GENERATOR / "test" / "config.json").write_text('{"scenarios": [7]}')
    with pytest.raises(UsageError, match="is not a list of scenarios"):
        scenarios(folder)
    shutil.rmtree(folder / GENERATOR)
    with pytest.raises(UsageError, match="--recurse-submodules"):
        scenarios(folder)


def test_a_texture_that_is_missing_is_no_difference(tmp_path: Path) -> None:
    """The model is read without its texture, but the image would differ, so nothing is judged."""
    folder = suite(tmp_path)
    write(folder, "stellar", expected(False))
    models = folder / GENERATOR / "models"
    (models / "wall.gltf").write_text(json.dumps({"asset": {"version": "2.0"}, "images": [{"uri": "a%20b.png"}]}))
    (one,) = scenarios(folder)
    (judged,) = judge([one._replace(model=models / "wall.gltf")], SIZE, 1)
    assert judged.row["result"] == "missing" and judged.row["problems"] == [str(models / "a b.png")]


def test_the_camera_is_on_its_orbit() -> None:
    """theta turns from +Z toward +X, phi is measured from +Y (spherical coordinates of three.js)."""
    target = {"x": 1.0, "y": 2.0, "z": 3.0}
    camera = orbit_camera(target, {"theta": 90, "phi": 90, "radius": 2}, 45)
    assert camera.position == pytest.approx((3, 2, 3)) and camera.look_at == pytest.approx((1, 2, 3))
    above = orbit_camera(target, {"theta": 0, "phi": 60, "radius": 2}, 45)
    assert above.position == pytest.approx((1, 3, 3 + 3**0.5))
    inside = orbit_camera(target, {"theta": 90, "phi": 90, "radius": 0}, 45)
    assert inside.position == pytest.approx((1, 2, 3)) and inside.look_at == pytest.approx((0, 2, 3))


def test_tone_mapping() -> None:
    """By hand: for white w the rows of the first matrix sum to 1, so v = w/0.6, and those of the second to 1."""
    v = 0.3 / 0.6
    fitted = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081)
    assert tone_mapped(np.full((1, 1, 3), 0.3)) == pytest.approx(np.full((1, 1, 3), fitted), rel=1e-4)
    assert tone_mapped(np.array([[[1e9, 1e9, 1e9], [0.0, 0.0, 0.0]]])).tolist() == [[[1, 1, 1], [0, 0, 0]]]


def test_reduction_keeps_means() -> None:
    image = np.random.default_rng(5).random((30, 42, 4)).astype(np.float32)
    assert reduced(image, (42, 30)) == pytest.approx(image, abs=1e-6)
    assert reduced(image, (21, 10)) == pytest.approx(image.reshape(10, 3, 21, 2, 4).mean((1, 3)), abs=1e-6)
    assert reduced(image, (17, 11)).mean((0, 1)) == pytest.approx(image.mean((0, 1)), abs=1e-6)


def shrunk_by_pillow(pixels: NDArray[np.float32], size: tuple[int, int]) -> NDArray[np.float32]:
    """Resize (h, w, c) with Pillow's Lanczos kernel, which has three lobes as well."""
    return np.stack(
        [
            np.asarray(PIL.Image.fromarray(channel).resize(size, PIL.Image.Resampling.LANCZOS))
            for channel in pixels.transpose(2, 0, 1)
        ],
        axis=2,
    )


@pytest.mark.parametrize("size", [(28, 20), (21, 10), (42, 30), (50, 40)])
def test_the_lanczos_kernel_is_pillow_s(size: tuple[int, int]) -> None:
    image = np.random.default_rng(6).random((30, 42, 3)).astype(np.float32)
    assert lanczos(image, size) == pytest.approx(shrunk_by_pillow(image, size), abs=1e-5)


def test_transparency_is_shrunk_before_the_white_is_laid_under_it() -> None:
    """A pixel half covered by an encoded value of 0.2: half of its light is that color, half is white."""
    rgba = np.full((8, 24, 4), 0.2, np.float32)
    rgba[..., 3] = np.arange(24) < 13
    light, covered = over_white(shrunk(rgba, (12, 4)))
    edge = shrunk_by_pillow(rgba, (12, 4))[0, 6, 3]
    assert covered[:, 6] == pytest.approx(edge, abs=1e-5) and 0.4 < edge < 0.6
    dark = float(linear_from_srgb(np.array(0.2, np.float32)))
    assert light[:, 6] == pytest.approx(edge * dark + 1 - edge, abs=1e-5)
    assert light[:, 1] == pytest.approx(dark, abs=1e-5) and light[:, 11] == pytest.approx(1, abs=1e-5)


def test_clrt_s_image_is_shrunk_as_the_website_s(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The website's image of the same wall, with alpha, equals clrt's, at the wall's edge as well."""
    folder = suite(tmp_path)
    (entry,) = json.loads((folder / GENERATOR / "test" / "config.json").read_text())["scenarios"]
    entry["target"] = {"x": 0.04}
    (folder / GENERATOR / "test" / "config.json").write_text(json.dumps({"scenarios": [entry]}))
    edge = 32 - 0.04 * 32 / (4 * np.tan(np.radians(22.5)))
    alpha = np.tile(np.clip(edge - np.arange(64, dtype=np.float32), 0, 1)[None, :, None], (64, 1, 1))
    colors = np.asarray(srgb(expected(False)[:1, :1]), np.float32) * alpha
    rgba = shrunk_by_pillow(np.concatenate([colors, alpha], axis=2), (SIZE, SIZE)).clip(0, 1)
    rgba[..., :3] /= np.maximum(rgba[..., 3:], 1 / 255)
    place = folder / "public" / "thumbnails" / "goldens" / "wall"
    place.mkdir(parents=True)
    texels = np.round(255 * rgba.clip(0, 1)).astype(np.uint8)
    PIL.Image.fromarray(texels).save(place / "stellar-golden.thumb.webp", quality=90)
    monkeypatch.setattr(render_fidelity, "WEBSITE_WIDTH", SIZE)
    (judged,) = judge(scenarios(folder), 64, 64)
    assert judged.images["clrt"] == pytest.approx(judged.images["stellar"], abs=0.02)


def test_images_are_decoded_as_they_were_encoded(tmp_path: Path) -> None:
    """Cycles' images use a power curve, others sRGB; transparency is over white; other aspect ratios are ignored."""
    import imageio.v3 as imageio

    texels = np.full((4, 4, 4), 51, np.uint8)
    texels[..., 3] = 255
    texels[:, 2:, 3] = 0
    path = Path(imageio.imwrite(tmp_path / "a.png", texels) or tmp_path / "a.png")
    for renderer, value in (("blender-cycles", 0.2**2.2), ("stellar", linear_from_srgb(np.array(0.2, np.float32)))):
        read = golden(renderer, path, (4, 4))
        assert read is not None
        assert read[0][0, :, 1] == pytest.approx(np.repeat([float(value), 1.0], 2), abs=1e-5)
        assert read[1] == pytest.approx(np.repeat([[1.0, 0.0]], 2, axis=1).repeat(4, axis=0), abs=1e-6)
    assert golden("stellar", path, (2, 3)) is None


def test_one_of_the_others_may_be_far_off() -> None:
    """clrt may differ from the others as much as the most distant of them; means within their range and 5 %."""
    images = {
        name: np.full((32, 32, 3), value, np.float32)
        for name, value in {"clrt": 0.3, "a": 0.5, "b": 0.5, "c": 0.2}.items()
    }
    means = {"": {name: float(image.mean()) for name, image in images.items()}}
    assert verdict(images, means)["result"] == "inside"
    images["clrt"] = np.full((32, 32, 3), 0.1, np.float32)
    means["part"] = {"clrt": 0.9, "a": 0.5, "b": 0.8, "c": 0.7}
    found = verdict(images, means)
    assert found["result"] == "outside" and found["strayed"] == ["part"] and found["mean_flip"] > found["spread"]
    assert found["means"]["part"]["beyond"] == pytest.approx(0.92 / 0.82)


def test_command(tmp_path: Path) -> None:
    folder = suite(tmp_path)
    write(folder, "vray", expected(False))
    write(folder, "stellar", expected(False))
    arguments = [
        str(folder),
        "--width",
        "16",
        "--spp",
        "1",
        "--json",
        str(tmp_path / "a.json"),
        "--pictures",
        str(tmp_path / "pictures"),
    ]
    run = CliRunner().invoke(render_fidelity_command, arguments, catch_exceptions=False)
    assert run.exit_code == 0 and "wall" in run.output and (tmp_path / "pictures" / "wall.png").is_file()
    assert json.loads((tmp_path / "a.json").read_text())["scenarios"][0]["scenario"] == "wall"
    with pytest.raises(UsageError, match="no scenario's name contains it"):
        CliRunner().invoke(render_fidelity_command, [str(folder), "--scenario", "roof"], catch_exceptions=False)
