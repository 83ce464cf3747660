"""Mitsuba's image tests: a fake checkout with closed forms as references, and Mitsuba compared with clrt."""

from __future__ import annotations

import json
from importlib import import_module
from math import pi
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.typing import NDArray

from clrt.bench.convergence.contestants import Picture, choices_on
from clrt.bench.renderers.agreement import compared, means_of
from clrt.bench.renderers.mitsuba_data import block_test, cases, judge, pixel_test
from clrt.cli.bench_mitsuba_data import mitsuba_data_command
from clrt.errors import UsageError
from clrt.formats.images.image_reader import read_texels
from clrt.formats.mitsuba.reader import read_mitsuba
from clrt.output.image import Image

SIZE = 16
#: A wall facing the camera, with a directional light along the view; its radiance is known at every point.
SCENE = """<scene version="3.0.0"><default name="integrator" value="path"/>
<integrator type="moment"><integrator type="$integrator"><integer name="max_depth" value="2"/></integrator></integrator>
<sensor type="perspective"><float name="fov" value="90"/><film type="hdrfilm"><rfilter type="box"/>
<integer name="width" value="16"/><integer name="height" value="16"/></film></sensor>
<shape type="rectangle"><bsdf type="diffuse"><rgb name="reflectance" value="0.5, 0.25, 0.75"/></bsdf>
<transform name="to_world"><scale value="9"/><rotate x="1" angle="180"/><translate z="1"/></transform></shape>
<emitter type="directional"><vector name="direction" value="0, 0, 1"/><rgb name="irradiance" value="2"/></emitter>{}
</scene>"""
RADIANCE = 2 / pi * np.array([0.5, 0.25, 0.75])
#: A small sphere in the center of the image, whose BSDF clrt does not support.
BALL = '<shape type="sphere"><float name="radius" value="0.1"/><point name="center" value="0, 0, 0.5"/>{}</shape>'


def checkout(folder: Path, mean: NDArray[np.float64], more: str = "") -> Path:
    """Create a folder laid out like mitsuba-data, with `mean` as its noise-free reference."""
    scenes = folder / "tests" / "scenes" / "wall"
    (scenes / "refs").mkdir(parents=True)
    (scenes / "test_wall_path.xml").write_text(SCENE.format(more))
    for name, pixels in (("ref_rgb", mean), ("ref_rgb_var", 0 * mean)):
        Image(pixels.astype(np.float32), {}).save(scenes / "refs" / f"test_wall_{name}.exr")
    return folder


@pytest.mark.parametrize(("change", "result"), [(1.0, "passed"), (1.1, "failed")])
def test_pictures_pass_that_are_right(tmp_path: Path, change: float, result: str) -> None:
    """The wall's radiance is irradiance · albedo / pi."""
    mean = np.tile(RADIANCE * change, (SIZE, SIZE, 1))
    (judged,) = judge(cases(checkout(tmp_path, mean)), samples(16))
    assert judged.row["result"] == result, judged.row
    assert judged.row["mean_ratio"] == pytest.approx([1 / change] * 3, rel=1e-5)
    assert (judged.row["blocks_rejected"] == 0) == (result == "passed")


def samples(spp: int) -> int:
    return spp * SIZE**2


def test_what_others_stand_in_for_is_left_out(tmp_path: Path) -> None:
    """Pixels of a sphere with an unsupported material and of its shadow are not tested; the others are."""
    mean = np.tile(RADIANCE, (SIZE, SIZE, 1))
    mean[6:10, 6:10] = 7
    folder = checkout(tmp_path, mean, BALL.format('<bsdf type="hair"/>'))
    (judged,) = judge(cases(folder), samples(16))
    assert judged.row["missing"] == ["bsdf hair"] and judged.row["result"] == "passed", judged.row
    assert 0.5 < judged.row["judged"] < 1 and judged.row["blocks_rejected"] == 0


@pytest.mark.parametrize(
    ("more", "missing"),
    [
        (BALL.format('<bsdf type="hair"/>').replace("sphere", "torus"), ["shape torus"]),
        ('<emitter type="ies"/>' + BALL.format('<bsdf type="hair"/>'), ["bsdf hair", "emitter ies"]),
    ],
    ids=["shape", "both"],
)
def test_what_cannot_be_expressed_is_listed(tmp_path: Path, more: str, missing: list[str]) -> None:
    (judged,) = judge(cases(checkout(tmp_path, np.ones((SIZE, SIZE, 3)), more)), samples(1))
    assert judged.row["result"] == "not expressible" and sorted(judged.row["missing"]) == sorted(missing)


def test_a_folder_without_references_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="tests/scenes"):
        cases(tmp_path)


def noisy(mean: NDArray[np.float64], spp: int, seeds: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return images whose samples have a variance of mean²."""
    return np.asarray(mean * rng.gamma(spp, 1 / spp, (seeds, *mean.shape)))


def test_both_tests_reject_as_often_as_they_should() -> None:
    """Mitsuba's rule rejects none of 200 images with the true mean, and the block test about 1 in 1000 families."""
    rng = np.random.default_rng(7)
    mean = np.random.default_rng(1).uniform(0.2, 2, (16, 16, 3))
    told = [
        (
            pixel_test(64 * 16, pictures.mean(0).reshape(-1, 3), mean.reshape(-1, 3), mean.reshape(-1, 3) ** 2),
            block_test(pictures, mean, mean**2),
        )
        for pictures in (noisy(mean, 64, 16, rng) for _ in range(200))
    ]
    assert all(pixels["passes"] for pixels, _ in told)
    assert sum(blocks["blocks_rejected"] for _, blocks in told) <= 3


@pytest.mark.parametrize("bias", [0.9, 1.1])
def test_blocks_find_what_pixels_hide(bias: float) -> None:
    """A bias of 10 % in one of four blocks is within a pixel's noise of 13 %, but not within that of a block's mean."""
    mean = np.random.default_rng(1).uniform(0.2, 2, (16, 16, 3))
    wrong = mean.copy()
    wrong[:8, :8] *= bias
    pictures = noisy(wrong, 4, 16, np.random.default_rng(2))
    assert pixel_test(64, pictures.mean(0).reshape(-1, 3), mean.reshape(-1, 3), mean.reshape(-1, 3) ** 2)["passes"]
    assert block_test(pictures, mean, mean**2)["blocks_rejected"] == 1


#: A scene with one of each feature that the reader supports.
MANY = """<scene version="3.0.0"><integrator type="path"><integer name="max_depth" value="4"/></integrator>
<sensor type="perspective"><float name="fov" value="50"/><transform name="to_world">
<lookat origin="1, -7, 3" target="0, 0, 1" up="0, 0, 1"/></transform><film type="hdrfilm"><rfilter type="box"/>
<integer name="width" value="48"/><integer name="height" value="48"/></film></sensor>
<bsdf type="twosided" id="board"><bsdf type="diffuse"><texture type="checkerboard" name="reflectance">
<rgb name="color0" value="0.8, 0.3, 0.2"/><rgb name="color1" value="0.1"/><transform name="to_uv"><scale x="4" y="3"/>
<rotate z="1" angle="20"/><translate x="0.3"/></transform></texture></bsdf></bsdf>
<shape type="rectangle"><transform name="to_world"><scale value="4"/></transform><ref id="board"/></shape>
<shape type="cube"><transform name="to_world"><scale x="-0.5" y="0.6" z="0.7"/><rotate z="1" angle="30"/>
<translate x="-1.8" z="0.8"/></transform><ref id="board"/></shape>
<shape type="cylinder"><point name="p0" value="1.5, 0, 0.3"/><point name="p1" value="2.2, 0.4, 1.6"/>
<float name="radius" value="0.4"/><ref id="board"/></shape>
<shape type="disk"><transform name="to_world"><rotate x="1" angle="70"/><translate x="-1" y="1.5" z="1.8"/></transform>
<ref id="board"/></shape>
<shape type="sphere"><point name="center" value="0, 0, 0.8"/><float name="radius" value="0.7"/>
<bsdf type="roughconductor"><string name="material" value="Cu"/><string name="distribution" value="ggx"/>
<float name="alpha" value="0.08"/></bsdf></shape>
<shape type="sphere"><transform name="to_world"><scale value="0.5"/><rotate x="1" angle="40"/>
<translate x="1" y="-1.5" z="0.6"/></transform><ref id="board"/></shape>
<shape type="sphere"><point name="center" value="-1, -1.5, 0.5"/><float name="radius" value="0.4"/>
<bsdf type="roughdielectric"><string name="distribution" value="ggx"/><float name="alpha" value="0.05"/></bsdf></shape>
<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="180"/><translate x="1" z="4"/></transform>
<emitter type="area"><spectrum name="radiance" value="400:1, 500:3, 700:6"/></emitter></shape>
<emitter type="point"><point name="position" value="3, -3, 3"/><rgb name="intensity" value="6, 3, 1"/></emitter>
<emitter type="directional"><vector name="direction" value="1, 1, -1"/><rgb name="irradiance" value="0.3"/></emitter>
<emitter type="constant"><rgb name="radiance" value="0.2, 0.3, 0.5"/></emitter></scene>"""


@pytest.mark.needs("mitsuba")
def test_mitsuba_reads_the_same_scene(tmp_path: Path) -> None:
    """Mitsuba's own images of the file have the same block means."""
    mitsuba = import_module("mitsuba")
    (tmp_path / "many.xml").write_text(MANY)
    mitsuba.set_variant("scalar_rgb")
    theirs = mitsuba.load_file(str(tmp_path / "many.xml"))

    def other(spp: int, seed: int) -> Picture:
        return Picture(spp, 0.0, 0.0, np.array(mitsuba.render(theirs, spp=spp, seed=seed))[..., :3])

    read = read_mitsuba(tmp_path / "many.xml")
    assert not read.differences
    ours = choices_on(read.scene, [0], {"clrt": {}})["clrt"]
    told = compared(means_of(ours, 64, range(8)), means_of(other, 64, range(8)))
    assert not told["rejected"] and told["mean_ratio"] == pytest.approx([1, 1, 1], abs=0.005), told


@pytest.mark.parametrize(("change", "code"), [(1.0, 0), (1.2, 1)])
def test_the_command_fails_where_a_scene_does(tmp_path: Path, change: float, code: int) -> None:
    """The failure is also in the printed table, the figures, and an image."""
    folder = checkout(tmp_path / "data", np.tile(RADIANCE * change, (SIZE, SIZE, 1)))
    done = CliRunner().invoke(
        mitsuba_data_command,
        [
            str(folder),
            "--samples",
            str(samples(16)),
            "--json",
            str(tmp_path / "told.json"),
            "--pictures",
            str(tmp_path),
        ],
    )
    (row,) = json.loads((tmp_path / "told.json").read_text())["scenes"]
    assert (done.exit_code, row["result"]) == (code, "failed" if code else "passed"), done.output
    assert ["wall/test_wall_path", row["result"]] in [line.split()[:2] for line in done.output.splitlines()]
    assert read_texels(tmp_path / "wall.test_wall_path.png").shape == (SIZE, 3 * SIZE, 4)
