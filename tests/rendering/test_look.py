"""One renderer, many cameras: each image equals that of a new renderer, bit for bit, with the same BVH."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clrt.device.open import Device
from clrt.errors import SceneError, UsageError
from clrt.rendering.renderer import Renderer, State
from clrt.scene.model import Camera

from .test_noise import room

HERE = room().camera
ASIDE = replace(HERE, position=(0.3, 2.2, 3.5), fov_degrees=50.0)
LENS = replace(ASIDE, aperture_radius=0.1)


def last(renderer: Renderer) -> State:
    return list(renderer.passes(spp=6))[-1]


@pytest.mark.programs
@pytest.mark.parametrize(("count", "cameras"), [(1, [ASIDE, LENS, LENS, HERE]), (2, [ASIDE])], ids=["alone", "crew"])
def test_pictures_are_those_of_new_renderers(device: Device, count: int, cameras: list[Camera]) -> None:
    """Also after an image that was left unfinished; adding or removing a lens switches to another program and
    session."""
    given: dict[str, Any] = {
        "size": (40, 30),
        "device": [device.info.index] * count,
        "spp": 6,
        "aovs": "depth,variance",
    }
    renderer = Renderer(room(), **given)
    tree, sessions = renderer.compiled.tree, [renderer.session]
    next(renderer.passes(spp=50))
    for camera in cameras:
        renderer.look(camera)
        sessions.append(renderer.session)
        anew = Renderer(replace(room(), camera=camera), **given)
        ours, theirs = last(renderer), last(anew)
        assert ours.film.pixels.tobytes() == theirs.film.pixels.tobytes() and ours.noise == theirs.noise
        assert [entry["spp"] for entry in renderer.history] == [entry["spp"] for entry in anew.history]
        for name, values in renderer.aovs(ours).items():
            np.testing.assert_array_equal(values, anew.aovs(theirs)[name])
        assert renderer.compiled.tree is tree and renderer.scene.camera == camera
    assert [a is b for a, b in pairwise(sessions)] == ([True, False, True, False] if count == 1 else [True])


def test_far_scenes_have_cameras_in_their_frame(device: Device) -> None:
    """A scene with another unit and origin: the camera is transformed into its frame."""
    scene = room()
    moved = replace(
        scene,
        spheres=[],
        camera=Camera(position=(0.0, 2e9, 3.9e9), look_at=(0.0, 1e9, 0.0)),
        meshes=[replace(mesh, vertices=mesh.vertices * np.float32(1e9)) for mesh in scene.meshes],
    )
    renderer = Renderer(moved, size=(24, 16), device=device.info.index)
    assert renderer.compiled.frame.unit != 1
    aside = replace(moved.camera, fov_degrees=20.0)
    renderer.look(aside)
    anew = Renderer(replace(moved, camera=aside), size=(24, 16), device=device.info.index)
    assert last(renderer).film.pixels.tobytes() == last(anew).film.pixels.tobytes()


def test_what_cannot_be_looked_at_is_refused(device: Device, tmp_path: Path) -> None:
    renderer = Renderer(room(), size=(8, 8), device=device.info.index)
    with pytest.raises(SceneError, match="Camera.look_at"):
        renderer.look(replace(HERE, look_at=HERE.position))
    kept = Renderer(room(), size=(8, 8), device=device.info.index, checkpoint=tmp_path / "a.ck")
    with pytest.raises(UsageError, match="a checkpoint stores one image"):
        kept.look(ASIDE)
