"""Datasets of views, as the programs that they are for read them."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.errors import UsageError
from clrt.output.datasets.coco import run_lengths
from clrt.output.datasets.colmap import quaternion
from clrt.scene.view import View

from .test_aov_files import layers as layers_of

SIZE = (12, 9)


def camera(number: int) -> clrt.Camera:
    """Return a calibrated camera, another one for each number."""
    random = np.random.default_rng(number)
    axes, _ = np.linalg.qr(random.normal(size=(3, 3)))
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    pose = np.column_stack([axes, random.normal(size=3)])
    return clrt.Camera.from_matrix(np.array([[20, 0, 5.5], [0, 21, 4.0], [0, 0, 1]]), SIZE, camera_to_world=pose)


def views(count: int) -> Iterator[View]:
    """Yield views with random layers."""
    for number in range(count):
        random = np.random.default_rng(number)
        shape = SIZE[::-1]
        layers: dict[str, NDArray[Any]] = {
            "rgb": random.random((*shape, 3), np.float32),
            "position": random.normal(size=(*shape, 3)).astype(np.float32),
            "depth": random.random((*shape, 1), np.float32),
            "instance_id": random.integers(-1, 3, (*shape, 1)).astype(np.int32),
            "flow": random.normal(size=(*shape, 2)).astype(np.float32),
        }
        yield View(camera(number), layers)


SCENE = clrt.Scene(
    spheres=[clrt.Sphere(center=(n, 0, 0), radius=1, name=name) for n, name in enumerate(("cow", "calf", "cow"))]
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a dataset of four views in all formats."""
    return clrt.save_views(tmp_path / "set", SCENE, views(4), ["nerf", "colmap", "coco"])


def test_files_hold_the_layers(folder: Path) -> None:
    for number, view in enumerate(views(4)):
        image = iio.imread(folder / f"images/view_{number:05}.png")
        assert image.shape == (*SIZE[::-1], 3)
        _, layers = layers_of(folder / f"layers/view_{number:05}.exr")
        for name, channels in {"depth": "Z", "instance_id": "X", "flow": "UV", "position": "XYZ"}.items():
            for index, channel in enumerate(channels):
                np.testing.assert_array_equal(layers[f"{name}.{channel}"], view.layers[name][..., index])


def test_transforms_hold_the_cameras(folder: Path) -> None:
    """A point seen by the matrices of the file is where the camera's own matrices have it."""
    content = json.loads((folder / "transforms.json").read_text())
    assert len(content["frames"]) == 4 and content["w"] == SIZE[0] and content["fl_y"] == pytest.approx(21)
    for number, frame in enumerate(content["frames"]):
        assert (folder / frame["file_path"]).is_file() and (folder / frame["layers_path"]).is_file()
        local = np.array([0.3, 0.2, -2.0, 1.0])  # ahead of an OpenGL camera
        world = np.array(frame["transform_matrix"]) @ local
        seen = camera(number).world_to_camera @ world
        np.testing.assert_allclose(seen, local * [1, -1, -1, 1], atol=1e-12)


@pytest.mark.needs("nerfbaselines")
def test_nerfbaselines_reads_the_transforms(folder: Path) -> None:
    from nerfbaselines.datasets.nerfstudio import load_nerfstudio_dataset

    data = load_nerfstudio_dataset(folder, split="train", train_split_fraction=1.0)
    numbers = [int(Path(path).stem[-5:]) for path in data["image_paths"]]
    poses = [np.asarray(pose, np.float64) for pose in data["cameras"].poses]
    expected = [np.linalg.inv(camera(number).world_to_camera) for number in numbers]
    assert len(numbers) >= 3
    np.testing.assert_allclose(data["cameras"].intrinsics, [[20, 21, 5.5, 4.0]] * len(numbers), rtol=1e-5)
    # The reader turns, moves and scales the world; the angles between cameras stay.
    for pose, own in zip(poses[1:], expected[1:]):
        np.testing.assert_allclose(poses[0][:3, :3].T @ pose[:3, :3], expected[0][:3, :3].T @ own[:3, :3], atol=1e-5)


@pytest.mark.needs("pycolmap")
def test_colmap_reads_its_model(folder: Path) -> None:
    import pycolmap

    model = pycolmap.Reconstruction(str(folder / "sparse" / "0"))
    assert len(model.images) == 4 and len(model.cameras) == 1 and len(model.points3D) == 4 * SIZE[0] * SIZE[1]
    for image in model.images.values():
        number = int(Path(image.name).stem[-5:])
        pose = image.cam_from_world() if callable(image.cam_from_world) else image.cam_from_world
        np.testing.assert_allclose(pose.matrix(), camera(number).world_to_camera[:3], atol=1e-12)
        np.testing.assert_allclose(model.cameras[image.camera_id].params, [20, 21, 5.5, 4.0])


@pytest.mark.needs("pycocotools")
def test_masks_are_the_instances(folder: Path) -> None:
    from pycocotools.coco import COCO

    coco = COCO(str(folder / "annotations.json"))
    assert {each["name"] for each in coco.cats.values()} == {"cow", "calf"}
    for number, view in enumerate(views(4)):
        ids = view.layers["instance_id"][..., 0]
        annotations = coco.loadAnns(coco.getAnnIds(imgIds=[number + 1]))
        assert len(annotations) == len(np.unique(ids[ids >= 0]))
        for each in annotations:
            mask = coco.annToMask(each).astype(bool)
            np.testing.assert_array_equal(mask, ids == each["object"])
            rows, columns = np.nonzero(mask)
            left, top = columns.min(), rows.min()
            assert each["bbox"] == [left, top, columns.max() - left + 1, rows.max() - top + 1]
            assert each["area"] == mask.sum()
            assert coco.cats[each["category_id"]]["name"] == SCENE.spheres[each["object"]].name


@pytest.mark.needs("pycocotools")
def test_the_instances_themselves_are_perfect_detections(folder: Path) -> None:
    """COCO's evaluation leaves out annotations that are marked as crowds."""
    from pycocotools.coco import COCO
    from pycocotools.cocoeval import COCOeval

    coco = COCO(str(folder / "annotations.json"))
    found = [
        {
            "image_id": each["image_id"],
            "category_id": each["category_id"],
            "segmentation": coco.annToRLE(each),
            "score": 1,
        }
        for each in coco.anns.values()
    ]
    judged = COCOeval(coco, coco.loadRes(found), "segm")
    judged.evaluate()
    judged.accumulate()
    judged.summarize()
    assert judged.stats[0] == 1


@pytest.mark.parametrize("seed", range(20))
def test_run_lengths_are_of_the_mask(seed: int) -> None:
    random = np.random.default_rng(seed)
    mask = random.random((random.integers(1, 9), random.integers(1, 9))) < random.choice([0, 0.2, 0.8, 1])
    lengths = run_lengths(mask)
    values = np.repeat(np.arange(len(lengths)) % 2 == 1, lengths)
    np.testing.assert_array_equal(values.reshape(mask.shape, order="F"), mask)


@pytest.mark.parametrize("seed", range(20))
def test_quaternions_turn_as_the_matrix_does(seed: int) -> None:
    random = np.random.default_rng(seed)
    axes, _ = np.linalg.qr(random.normal(size=(3, 3)))
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    if seed < 3:
        axes = np.diag(np.roll([1.0, -1.0, -1.0], seed))  # half turns, whose w is 0
    w, x, y, z = quaternion(axes)
    v, u = random.normal(size=3), np.array([x, y, z])
    np.testing.assert_allclose(v + 2 * np.cross(u, np.cross(u, v) + w * v), axes @ v, atol=1e-12)


def test_what_a_format_lacks_is_named(tmp_path: Path) -> None:
    (view,) = views(1)
    with pytest.raises(UsageError, match="did you mean nerf"):
        clrt.save_views(tmp_path, SCENE, [view], "nref")  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="instance_id"):
        clrt.save_views(tmp_path, SCENE, [View(view.camera, {"rgb": view.layers["rgb"]})], "coco")
    with pytest.raises(UsageError, match="view 0 has projection 'orthographic'"):
        clrt.save_views(tmp_path, SCENE, [View(clrt.Camera(projection="orthographic"), view.layers)])


def test_colors_have_their_alpha(tmp_path: Path) -> None:
    """A view's .png has it, and an .exr of a view without colors."""
    pixels = np.full((*SIZE[::-1], 3), 0.25, np.float32)
    alpha = np.full((*SIZE[::-1], 1), 0.5, np.float32)
    clrt.save_views(tmp_path / "a", clrt.Scene(), [View(camera(0), {"rgb": pixels, "alpha": alpha})])
    found = iio.imread(tmp_path / "a" / "images" / "view_00000.png")
    assert found.shape == (*SIZE[::-1], 4) and found[0, 0].tolist() == [188, 188, 188, 128]  # the view of 0.25 / 0.5
    assert list((tmp_path / "a" / "layers").iterdir()) == []
    clrt.save_views(tmp_path / "b", clrt.Scene(), [View(camera(0), {"alpha": alpha})])
    assert (tmp_path / "b" / "layers" / "view_00000.exr").is_file()


DISTORTED: dict[str, dict[str, Any]] = {
    "OPENCV": {"distortion": [-0.2, 0.05, 0.002, -0.003]},
    "FULL_OPENCV": {"distortion": [0.9, 0.4, 0.002, -0.003, 0.02, 1.2, 0.5, 0.1]},
    "OPENCV_FISHEYE": {"projection": "fisheye", "distortion": [0.05, -0.02, 0.004, -0.001]},
}


def seen_through(lens: dict[str, Any]) -> View:
    """Return a view of a camera with distortion."""
    K = np.array([[20, 0, 5.5], [0, 21, 4.0], [0, 0, 1]])
    made = clrt.Camera.from_matrix(K, SIZE, world_to_camera=np.eye(4), **lens)
    return View(made, {"rgb": np.zeros((*SIZE[::-1], 3), np.float32)})


@pytest.mark.needs("pycolmap")
@pytest.mark.parametrize("model", DISTORTED)
def test_colmap_projects_through_the_lens(tmp_path: Path, model: str) -> None:
    import pycolmap

    view = seen_through(DISTORTED[model])
    folder = clrt.save_views(tmp_path, SCENE, [view], "colmap")
    (camera,) = pycolmap.Reconstruction(str(folder / "sparse" / "0")).cameras.values()
    assert camera.model.name == model
    points = np.random.default_rng(4).uniform((-0.4, -0.4, 1.0), (0.4, 0.4, 2.0), (50, 3))
    np.testing.assert_allclose(camera.img_from_cam(points), view.camera.project(points, SIZE), atol=1e-9)


def test_transforms_hold_the_distortion(tmp_path: Path) -> None:
    for model, keys in (("OPENCV", ("k1", "k2", "p1", "p2")), ("OPENCV_FISHEYE", ("k1", "k2", "k3", "k4"))):
        views = [seen_through(DISTORTED[model])] * 2
        content = json.loads((clrt.save_views(tmp_path / model, SCENE, views) / "transforms.json").read_text())
        assert content["camera_model"] == model and content.get("is_fisheye", False) == (model != "OPENCV")
        assert [content[key] for key in keys] == DISTORTED[model]["distortion"]
        assert "k1" not in content["frames"][0]
    mixed = [seen_through({}), seen_through(DISTORTED["OPENCV"])]
    content = json.loads((clrt.save_views(tmp_path / "mixed", SCENE, mixed) / "transforms.json").read_text())
    assert "k1" not in content and [frame.get("k1", 0.0) for frame in content["frames"]] == [0.0, -0.2]


def test_distortion_that_transforms_lack_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="k4, k5, k6"):
        clrt.save_views(tmp_path, SCENE, [seen_through(DISTORTED["FULL_OPENCV"])])
    with pytest.raises(UsageError, match="one camera_model"):
        clrt.save_views(tmp_path, SCENE, [seen_through(DISTORTED[model]) for model in ("OPENCV", "OPENCV_FISHEYE")])
