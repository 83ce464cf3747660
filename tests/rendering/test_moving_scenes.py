"""Renderer.show: images of scenes whose vertices move, with a refitted BVH, are those of new renderers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.accel.refit import can_refit, relative_area
from clrt.device.open import Device

from ..scene.shapes import icosphere

VERTICES, FACES = icosphere(2)
CAMERA = clrt.Camera(position=(0, 0, 5), fov_degrees=50)
SKY = clrt.Environment(color=(0.3, 0.5, 0.9))


def scene(phase: float, shift: float = 0.0) -> clrt.Scene:
    """Return a wavy sphere of 320 triangles next to another one, which `shift` moves."""
    waves = VERTICES * (1 + 0.3 * np.sin(3 * VERTICES[:, :1] + phase))
    meshes = [
        clrt.Mesh(waves - [1, 0, 0], FACES, clrt.Diffuse()),
        clrt.Mesh(VERTICES + np.array([1, shift, 0]), FACES, clrt.Diffuse(color=(0.2, 0.6, 0.2))),
    ]
    return clrt.Scene(meshes=meshes, camera=CAMERA, environment=SKY)


def begun(device: Device, shown: clrt.Scene) -> clrt.Renderer:
    return clrt.Renderer(shown, device=device.info.index, size=(24, 16), spp=4, layout="bvh8")


def image(renderer: clrt.Renderer) -> NDArray[np.float32]:
    *_, last = renderer.passes()
    return last.pixels


def test_moved_scenes_give_the_images_of_new_renderers(device: Device) -> None:
    """After vertices moved the BVH is refitted in place; with other faces it is built again; a camera keeps all."""
    renderer = begun(device, scene(0))
    first = image(renderer)
    assert can_refit(renderer.compiled.tree)
    trees = []
    fewer, later = scene(2.0), scene(3.0)
    fewer.meshes[1].faces = later.meshes[1].faces = FACES[:100]
    turned = replace(scene(2.5, 0.4), camera=clrt.Camera(position=(3, 0, 4)))
    for each in (scene(1.0), scene(2.5, 0.4), turned, fewer, later):
        renderer.show(each)
        trees.append(renderer.compiled.tree.buffers["nodes"])
        np.testing.assert_array_equal(image(renderer), image(begun(device, each)))
    assert trees[0] is trees[1] is trees[2] and trees[3] is not trees[0] and trees[4] is not trees[0]
    renderer.show(scene(0))
    np.testing.assert_array_equal(image(renderer), first)


def test_what_moves_far_apart_gets_a_new_bvh(device: Device) -> None:
    """Triangles that swap their places enlarge the boxes of a refitted BVH."""
    rng = np.random.default_rng(4)
    places, faces = rng.uniform(-1, 1, (300, 1, 3)), np.arange(900, dtype=np.int32).reshape(-1, 3)
    trees = []
    renderer = None
    for moved in (places, places + 0.1 * places**2, rng.permutation(places)):
        mesh = clrt.Mesh((moved + 0.05 * np.eye(3)).reshape(-1, 3).astype(np.float32), faces)
        content = clrt.Scene(meshes=[mesh], camera=CAMERA, environment=SKY)
        renderer = renderer or begun(device, scene(0))
        renderer.show(content)
        trees.append(renderer.compiled.tree)
        np.testing.assert_array_equal(image(renderer), image(begun(device, content)))
    assert trees[1].buffers["nodes"] is not trees[2].buffers["nodes"]
    assert relative_area(device, trees[2]) < 1.5 * relative_area(device, trees[0])


def test_scenes_that_are_wrong(device: Device) -> None:
    """The last image can still be rendered."""
    renderer = begun(device, scene(0))
    with pytest.raises(clrt.UsageError, match="scene: 3.0 is not of type Scene; write a clrt.Scene"):
        renderer.show(3.0)  # type: ignore[arg-type]
    with pytest.raises(clrt.SceneError, match="is not finite"):
        renderer.show(scene(np.nan))
    expected = image(renderer)
    renderer.show(scene(1))
    assert np.isfinite(image(renderer)).all() and (image(renderer) != expected).any()
