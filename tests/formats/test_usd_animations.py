"""Animations of USD files: transforms, points, skeletons, lights and cameras at the time codes of frames."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest

import clrt
from clrt.errors import SceneError
from clrt.scene.animation import ModelAnimation

from .usd_files import SQUARE, animated, mesh, usda

pytest.importorskip("pxr")
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
RIDE = """def Xform "ride" {
    double3 xformOp:translate.timeSamples = { 12: (0, 0, 0), 36: (12, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
    CONTENT }
"""
CAMERA = 'def Camera "eye" { float focalLength = 50 }\n'
LIGHT = 'def SphereLight "lamp" (prepend apiSchemas = ["LightAPI"]) { float inputs:radius = 0.5 }\n'
BREATH = """point3f[] points.timeSamples = {
    12: [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)],
    36: [(0, 0, 0), (3, 0, 0), (3, 5, 0), (0, 5, 0)] }
"""
ARM = """def SkelRoot "root" (prepend apiSchemas = ["SkelBindingAPI"]) {
    def Skeleton "arm" (prepend apiSchemas = ["SkelBindingAPI"]) {
        uniform token[] joints = ["a", "a/b"]
        uniform matrix4d[] bindTransforms = [
            ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)),
            ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,1,0,1))]
        uniform matrix4d[] restTransforms = [
            ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)),
            ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,1,0,1))]
        rel skel:animationSource = </root/arm/bend>
        def SkelAnimation "bend" {
            uniform token[] joints = ["a/b"]
            float3[] translations = [(0, 1, 0)]
            quatf[] rotations.timeSamples = { 12: [(1, 0, 0, 0)], 36: [(0.70710678, 0, 0, 0.70710678)] }
            half3[] scales = [(1, 1, 1)]
        }
    }
    MESH }
"""
BOUND = """
    rel skel:skeleton = </root/arm>
    int[] primvars:skel:jointIndices = [0, 0, 1, 1] (
    elementSize = 1
    interpolation = "vertex"
    )
    float[] primvars:skel:jointWeights = [1, 1, 1, 1] (
    elementSize = 1
    interpolation = "vertex"
    )
    matrix4d primvars:skel:geomBindTransform = ((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1))
"""


def written(folder: Path, content: str) -> Path:
    path = folder / "a.usda"
    path.write_text(animated(content))
    return path


def test_transforms_cameras_and_lights_move(tmp_path: Path) -> None:
    """The stage's 24 codes are half a second, and frame n at n/12 s is 4 n codes after its start."""
    scene = clrt.load(written(tmp_path, RIDE.replace("CONTENT", mesh() + CAMERA + LIGHT) + mesh(name="still")))
    assert isinstance(scene.animation, ModelAnimation)
    assert (scene.animation.seconds, scene.animation.fps, scene.animation.frames) == (0.5, 12, 7)
    for number, frame in clrt.frames(scene):
        ride, still, lamp = frame.meshes
        assert ride.vertices == pytest.approx(CORNERS + [2 * number, 0, 0])
        assert still.vertices == pytest.approx(CORNERS)
        assert lamp.vertices.mean(axis=0) == pytest.approx([2 * number, 0, 0], abs=1e-5)
        assert frame.camera.position == pytest.approx((2 * number, 0, 0))
        assert [part.material for part in frame.meshes] == [part.material for part in scene.meshes]
        alone = clrt.load(tmp_path / "a.usda", time=number / 12)
        for one, other in zip(frame.meshes, alone.meshes, strict=True):
            np.testing.assert_array_equal(one.vertices, other.vertices)


def test_points_move(tmp_path: Path) -> None:
    scene = clrt.load(written(tmp_path, mesh(BREATH, base=SQUARE.replace("point3f[] points =", "float3[] unused ="))))
    for number, frame in clrt.frames(scene):
        assert frame.meshes[0].vertices == pytest.approx(CORNERS * [1 + number / 3, 1 + 2 * number / 3, 1])


def test_skeletons_move(tmp_path: Path) -> None:
    """The upper corners follow a joint at (0, 1, 0) that turns by 90 degrees about z."""
    skinned = mesh(BOUND).replace('["MaterialBindingAPI"]', '["MaterialBindingAPI", "SkelBindingAPI"]')
    scene = clrt.load(written(tmp_path, ARM.replace("MESH", skinned)))
    for number, frame in clrt.frames(scene):
        angle = np.radians(15 * number)
        expected = CORNERS.astype(np.float64)
        expected[2] = np.cos(angle), 1 + np.sin(angle), 0
        assert frame.meshes[0].vertices == pytest.approx(expected, abs=1e-5)


def test_blend_shapes_move(tmp_path: Path) -> None:
    """A shape key lifts the square by 2, weighted from 0 to 1."""
    shapes = """
    rel skel:skeleton = </root/arm>
    uniform token[] skel:blendShapes = ["up"]
    rel skel:blendShapeTargets = </root/square/up>
    def BlendShape "up" {
        uniform vector3f[] offsets = [(0, 0, 2), (0, 0, 2), (0, 0, 2), (0, 0, 2)]
        uniform int[] pointIndices = [0, 1, 2, 3]
    }
"""
    lifted = mesh(shapes).replace('["MaterialBindingAPI"]', '["MaterialBindingAPI", "SkelBindingAPI"]')
    weights = 'uniform token[] blendShapes = ["up"]\nfloat[] blendShapeWeights.timeSamples = { 12: [0], 36: [1] }\n'
    content = ARM.replace("MESH", lifted).replace("half3[] scales", weights + "half3[] scales")
    for number, frame in clrt.frames(clrt.load(written(tmp_path, content))):
        assert frame.meshes[0].vertices == pytest.approx(CORNERS + [0, 0, number / 3], abs=1e-6)


def test_names_and_scene_files(tmp_path: Path) -> None:
    """The only animation is "stage", also in scene files; a time makes a still of it."""
    path = written(tmp_path, RIDE.replace("CONTENT", mesh()))
    source = clrt.load(path, animation="stage").source
    assert source is not None and source.contents["animations"] == ["stage"]
    assert clrt.load(path, time=0.25).animation is None
    with pytest.raises(SceneError, match='a.usda: animation: "run" is unknown; use one of "stage"'):
        clrt.load(path, animation="run")
    (tmp_path / "s.toml").write_text('[[mesh]]\nfile = "a.usda"\nanimation = "stage"\ntranslate = [0, 7, 0]\n')
    ((_, frame),) = clrt.frames(clrt.load(tmp_path / "s.toml"), [6])
    assert frame.meshes[0].vertices == pytest.approx(CORNERS + [6, 7, 0]), "24 frames per second"


def test_stages_without_animation(tmp_path: Path) -> None:
    """Time codes alone are none, nor are values at times without time codes."""
    assert clrt.load(written(tmp_path, mesh())).animation is None
    assert clrt.load(usda(tmp_path, RIDE.replace("CONTENT", mesh()), name="b.usda")).animation is None
    path = written(tmp_path, RIDE.replace("CONTENT", mesh()))
    for one, other in [("endTimeCode = 36", "endTimeCode = 1"), ("PerSecond = 48", "PerSecond = 0")]:
        (tmp_path / "c.usda").write_text(path.read_text().replace(one, other))
        assert clrt.load(tmp_path / "c.usda").animation is None


def test_warnings_are_logged_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        list(clrt.frames(clrt.load(written(tmp_path, RIDE.replace("CONTENT", mesh() + 'def BasisCurves "c" {}')))))
    assert len(caplog.messages) == 1 and "BasisCurves" in caplog.text
