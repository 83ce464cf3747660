"""Mitsuba reads its own files in `clrt bench converge`, with the size and path depth that clrt renders."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import clrt
from clrt.bench.renderers import mitsuba_renderer
from clrt.bench.renderers.mitsuba_renderer import contestants, load
from clrt.errors import UsageError

pytestmark = pytest.mark.needs("mitsuba")
#: A material that clrt's converter to Mitsuba refuses, a default, a film of another size, and a part in another file.
SCENE = """<scene version="3.0.0">
  <default name="wide" value="400"/>
  <integrator type="path"><integer name="max_depth" value="2"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="40"/>
    <transform name="to_world"><lookat origin="0, 3, 6" target="0, 0.5, 0" up="0, 1, 0"/></transform>
    <film type="hdrfilm"><integer name="width" value="$wide"/><integer name="height" value="300"/>
      <rfilter type="box"/></film>
  </sensor>
  <shape type="sphere"><point name="center" x="0" y="1" z="0"/>
    <bsdf type="roughplastic"><rgb name="diffuse_reflectance" value="0.6, 0.3, 0.2"/><float name="alpha" value="0.3"/>
      <boolean name="nonlinear" value="true"/></bsdf></shape>
  <include filename="floor.xml"/>
  <emitter type="constant"><rgb name="radiance" value="1, 1.2, 1.5"/></emitter>
</scene>"""
FLOOR = """<scene version="3.0.0"><shape type="rectangle">
  <transform name="to_world"><rotate x="1" angle="-90"/><scale value="4"/></transform>
  <bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.5, 0.5, 0.5"/></bsdf></bsdf>
</shape></scene>"""


@pytest.fixture(autouse=True)
def scalar(monkeypatch: pytest.MonkeyPatch) -> None:
    """Use the variant of the other tests: two versions of LLVM in a process may crash it."""
    monkeypatch.setattr(mitsuba_renderer, "load", partial(load, "scalar_rgb"))


def test_mitsuba_reads_its_own_file(tmp_path: Path) -> None:
    file = tmp_path / "plastic.xml"
    file.write_text(SCENE)
    (tmp_path / "floor.xml").write_text(FLOOR)
    scene = clrt.load(file)
    scene = replace(scene, render=replace(scene.render, size=(40, 30), max_depth=4))
    own = clrt.render(scene, spp=256).pixels
    for theirs in contestants(scene, file).values():
        picture = theirs(256, 1)
        assert picture.pixels.shape == own.shape
        np.testing.assert_allclose(picture.pixels.mean((0, 1)), own.mean((0, 1)), rtol=0.004)


def test_a_file_that_mitsuba_refuses_is_named(tmp_path: Path) -> None:
    file = tmp_path / "wrong.xml"
    file.write_text(SCENE.replace('<include filename="floor.xml"/>', '<shape type="banana"/>'))
    scene = clrt.Scene(meshes=[], environment=clrt.Environment())
    with pytest.raises(UsageError, match=r"wrong\.xml: Mitsuba refuses it: .*banana"):
        contestants(scene, file)
