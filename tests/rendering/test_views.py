"""Images from many cameras: as single renders, and optical flow against projections."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.device.open import Device
from clrt.errors import SceneError, UsageError

SCENES = Path(__file__).parents[2] / "scenes"
SIZE = (40, 30)


def around(scene: clrt.Scene, count: int) -> list[clrt.Camera]:
    """Return cameras on a circle."""
    return [view.camera for _, view in clrt.frames(clrt.turntable(scene, frames=count))]


def test_each_view_is_that_of_a_render_of_its_own(device: Device) -> None:
    scene = clrt.load(SCENES / "spot.toml")
    options: dict[str, Any] = {"size": SIZE, "spp": 4, "device": device.info.index}
    cameras = around(scene, 3)
    layers = ["rgb", "depth", "normal", "instance_id", "material_id", "indirect"]
    arrays = clrt.render_views(scene, iter(cameras), layers, **options)
    assert list(arrays) == layers
    for number, camera in enumerate(cameras):
        aovs = ["depth", "normal", "object", "material", "indirect"]
        image = clrt.render(replace(scene, camera=camera), aovs=aovs, **options)
        for name, expected in zip(layers, [image.pixels, *image.aovs.values()]):
            assert arrays[name][number].shape[:2] == SIZE[::-1]
            np.testing.assert_array_equal(arrays[name][number].reshape(expected.shape), expected)


def test_alpha_makes_views_transparent(device: Device) -> None:
    scene = clrt.load(SCENES / "spot.toml")
    options: dict[str, Any] = {"size": SIZE, "spp": 4, "device": device.info.index}
    found = clrt.render_views(scene, [scene.camera], ["rgb", "alpha"], **options)
    expected = clrt.render(scene, transparent=True, **options)
    assert expected.alpha is not None and 0 < expected.alpha.mean() < 1
    np.testing.assert_array_equal(np.concatenate([found["rgb"][0], found["alpha"][0]], axis=2), expected.layers)


@pytest.mark.programs
def test_without_light_the_layers_are_the_same(device: Device) -> None:
    scene = clrt.load(SCENES / "textures.toml")
    options: dict[str, Any] = {"size": SIZE, "spp": 1, "device": device.info.index}
    names = ["albedo", "normal", "object", "material", "depth", "position"]
    lit = clrt.render_views(scene, [scene.camera], ["rgb", *names], **options)
    unlit = clrt.render_views(scene, [scene.camera], names, **options)
    for name in names:
        np.testing.assert_array_equal(unlit[name], lit[name])


@pytest.mark.programs
def test_a_ground_is_the_last_object_with_light_and_without(device: Device, tmp_path: Path) -> None:
    """The numbers of instances and spheres are theirs, whatever the ground; annotations leave it out."""
    cube = clrt.load(SCENES / "models" / "spot.obj").meshes[0]
    scene = clrt.Scene(
        meshes=[cube],
        instances=[clrt.Instance(cube, np.eye(3, 4) + [[0, 0, 0, 1.5], [0] * 4, [0] * 4], name="other")],
        spheres=[clrt.Sphere(center=(-1.5, 0, 0), radius=0.5, material=clrt.Diffuse(), name="ball")],
        ground=clrt.Ground(height=-1, radius=5),
        environment=clrt.Environment(color=(1, 1, 1)),
        camera=clrt.Camera(position=(0, 1, 6), look_at=(0, 0, 0)),
    )
    below = replace(scene.camera, position=(0.0, -2.0, 6.0))
    cameras = [scene.camera, below, scene.camera]
    names = ["depth", "instance_id", "material_id"]
    options: dict[str, Any] = {"size": SIZE, "spp": 1, "device": device.info.index}
    lit = clrt.render_views(scene, cameras, ["rgb", *names], **options)
    unlit = clrt.render_views(scene, cameras, names, **options)
    for name in names:
        np.testing.assert_array_equal(unlit[name], lit[name])
    objects = len(scene.meshes) + len(scene.instances) + len(scene.spheres)
    assert {*np.unique(lit["instance_id"][0]).tolist()} == {-1, *range(objects + 1)}
    assert lit["instance_id"][0, -1, SIZE[0] // 2, 0] == objects
    assert lit["instance_id"][1].max() == objects - 1
    folder = clrt.save_views(tmp_path, scene, clrt.each_view(scene, cameras, names, **options), "coco")
    annotations = json.loads((folder / "annotations.json").read_text())["annotations"]
    assert {each["object"] for each in annotations} == {*range(objects)}


def test_flow_leads_to_the_same_point(device: Device) -> None:
    """Where the next view shows the point that the flow leads to, its position there is that point."""
    scene = clrt.load(SCENES / "spot.toml")
    first = scene.camera
    second = replace(first, position=(1.7, 1.75, 5.3), lens_shift=(0.02, -0.03), pixel_aspect=1.1)
    size = (160, 120)
    views = clrt.render_views(
        scene, [first, second], ["flow", "position", "object"], size=size, device=device.info.index
    )
    flow, position = views["flow"][0].astype(np.float64), views["position"].astype(np.float64)
    assert np.isnan(views["flow"][1]).all()
    assert (np.isnan(flow[..., 0]) == (views["object"][0, ..., 0] < 0)).all()
    y, x = np.mgrid[: size[1], : size[0]]
    there = np.stack([x + 0.5 + flow[..., 0], y + 0.5 + flow[..., 1]], axis=-1)
    inside = np.isfinite(there).all(axis=2) & (there > 1).all(axis=2) & (there < np.array(size) - 1).all(axis=2)
    column, row = np.floor(there[inside]).astype(int).T
    moved = there[inside] - np.stack([column + 0.5, row + 0.5], axis=-1)
    expected = position[0][inside]
    found = position[1][row, column]
    # Within a pixel the position changes by at most about what it does to the neighboring pixels.
    step = np.abs(position[1][row, column - 1] - found) + np.abs(position[1][row - 1, column] - found)
    same = views["object"][1, row, column, 0] == views["object"][0][inside][:, 0]
    near = (np.abs(expected - found) <= 2 * np.abs(moved).max() * step + 0.02).all(axis=1)
    assert inside.mean() > 0.8 and near[same].mean() > 0.95


def test_a_camera_that_stays_has_no_flow(device: Device) -> None:
    scene = clrt.load(SCENES / "spot.toml")
    layers = ["flow", "position", "object"]  # the program of the test before
    views = clrt.render_views(scene, [scene.camera] * 2, layers, size=SIZE, device=device.info.index)
    assert np.nanmax(np.abs(views["flow"][0])) < 2e-3


def test_what_cannot_be_rendered_is_named(device: Device) -> None:
    scene = clrt.load(SCENES / "spot.toml")
    layers = ["position", "object"]  # the program of the tests before
    with pytest.raises(UsageError, match=r"layer 'rbg' is unknown; .* did you mean rgb\?"):
        clrt.render_views(scene, [scene.camera], ["rbg"])
    with pytest.raises(UsageError, match="no layers"):
        clrt.render_views(scene, [scene.camera], [])
    with pytest.raises(SceneError, match=r"view 1: camera: .* is not of type Camera"):
        wrong: Any = "front"
        clrt.render_views(scene, [scene.camera, wrong], ["flow", *layers], size=SIZE, device=device.info.index)
    with pytest.raises(UsageError, match="equirectangular"):
        cameras = [scene.camera, replace(scene.camera, projection="equirectangular")]
        clrt.render_views(scene, cameras, ["flow", *layers], size=SIZE, device=device.info.index)
    assert clrt.render_views(scene, [], "depth") == {}
