"""KHR_animation_pointer: what else of a glTF file an animation changes, at times in between its keyframes."""

from __future__ import annotations

import io
import logging
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

import clrt
from clrt.errors import SceneError
from clrt.scene.lights import PointLight, SpotLight
from clrt.scene.materials.material_types import Diffuse, MetallicRoughness

from ..covering import others
from .glb import TRIANGLE, Gltf, ball


def pointing(pointer: str, values: Any, dtype: str = "<f4", interpolation: str = "LINEAR") -> Gltf:
    """Return two triangles, with a material each, a camera and a spot light, of which one property is animated from 0
    to 1 seconds."""
    gltf = Gltf()
    position = {"POSITION": gltf.accessor(TRIANGLE)}
    moves = gltf.accessor(np.ones((3, 3), np.float32))
    gltf.mesh(attributes=position, material=0, targets=[{"POSITION": moves}])
    gltf.mesh(attributes=position, material=1)
    gltf.node(camera=0, name="eye", translation=[0, 0, 9])
    gltf.node(extensions={"KHR_lights_punctual": {"light": 0}})
    gltf.document["materials"] = [{"name": "one"}, {"name": "two", "pbrMetallicRoughness": {"metallicFactor": 0.5}}]
    gltf.document["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1}}]
    gltf.document["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "spot", "spot": {}}]}}
    gltf.document["extensionsUsed"] = ["KHR_lights_punctual", "KHR_animation_pointer", "KHR_node_visibility"]
    values = np.asarray(values)
    sampler = {"input": gltf.accessor(np.array([0.0, 1.0])), "output": gltf.accessor(values, dtype)}
    target = {"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": pointer}}}
    gltf.document["animations"] = [
        {"samplers": [{**sampler, "interpolation": interpolation}], "channels": [{"sampler": 0, "target": target}]}
    ]
    return gltf


def at(gltf: Gltf, folder: Path, time: float) -> clrt.Scene:
    """Return the frame at a time, which is that of a still."""
    path = gltf.write(folder / "a.glb")
    ((_, frame),) = clrt.frames(clrt.load(path, animation=0), [round(time * 24)])
    still = clrt.load(path, time=time)
    assert [repr(mesh.material) for mesh in frame.meshes] == [repr(mesh.material) for mesh in still.meshes]
    assert (frame.camera.fov_degrees, frame.lights) == (still.camera.fov_degrees, still.lights)
    return frame


def material(scene: clrt.Scene, number: int = 0) -> MetallicRoughness:
    found = scene.meshes[number].material
    assert isinstance(found, MetallicRoughness)
    return found


def test_colors_of_materials(tmp_path: Path) -> None:
    """Those of other materials stay."""
    gltf = pointing("/materials/0/pbrMetallicRoughness/baseColorFactor", [[1.0, 0, 0, 1], [0, 1, 0.5, 1]])
    frame = at(gltf, tmp_path, 0.25)
    assert material(frame).color == pytest.approx((0.75, 0.25, 0.125))
    assert material(frame, 1).color == (1, 1, 1) and material(frame, 1).metallic == 0.5
    frame = at(pointing("/materials/1/emissiveFactor", [[0.0, 0, 0], [1, 0.5, 0]]), tmp_path, 0.5)
    assert material(frame, 1).emission == pytest.approx((0.5, 0.25, 0)) and material(frame).emission == (0, 0, 0)


@pytest.mark.parametrize(
    ("pointer", "field", "expected"),
    [
        ("pbrMetallicRoughness/metallicFactor", "metallic", 0.3),
        ("pbrMetallicRoughness/roughnessFactor", "roughness", 0.3),
        ("extensions/KHR_materials_clearcoat/clearcoatFactor", "clearcoat", 0.3),
        ("extensions/KHR_materials_transmission/transmissionFactor", "transmission", 0.3),
    ],
)
def test_numbers_of_materials(pointer: str, field: str, expected: float, tmp_path: Path) -> None:
    frame = at(pointing(f"/materials/0/{pointer}", [0.1, 0.5]), tmp_path, 0.5)
    assert getattr(material(frame), field) == pytest.approx(expected)


def test_materials_that_replace_the_files_stay(tmp_path: Path) -> None:
    """Of a program, which replaces the mesh's, and of a scene file; the others are animated."""
    path = pointing("/materials/0/pbrMetallicRoughness/metallicFactor", [0.0, 1.0]).write(tmp_path / "a.glb")
    scene, red = clrt.load(path), Diffuse(color=(1, 0, 0))
    scene.meshes[0].material = red
    ((_, frame),) = clrt.frames(scene, [12])
    assert frame.meshes[0].material is red
    (tmp_path / "a.toml").write_text(
        '[materials.red]\ntype = "diffuse"\n[[mesh]]\nfile = "a.glb"\nanimation = "0"\nmaterials = { one = "red" }\n'
        '[[mesh]]\nfile = "a.glb"\nanimation = "0"\n'
    )
    ((_, frame),) = clrt.frames(clrt.load(tmp_path / "a.toml"), [12])
    assert isinstance(frame.meshes[0].material, Diffuse) and material(frame, 2).metallic == pytest.approx(0.5)


def test_lights_and_cameras(tmp_path: Path) -> None:
    lights = "/extensions/KHR_lights_punctual/lights/0"
    (light,) = at(pointing(f"{lights}/intensity", [1.0, 3.0]), tmp_path, 0.25).lights
    assert isinstance(light, SpotLight) and light.intensity == pytest.approx((1.5, 1.5, 1.5))
    (light,) = at(pointing(f"{lights}/color", [[1.0, 1, 1], [0, 1, 0.5]]), tmp_path, 0.5).lights
    assert isinstance(light, PointLight | SpotLight) and light.intensity == pytest.approx((0.5, 1, 0.75))
    (light,) = at(pointing(f"{lights}/spot/outerConeAngle", [0.5, 1.0]), tmp_path, 0.5).lights
    assert isinstance(light, SpotLight) and light.outer_degrees == pytest.approx(math.degrees(0.75))
    frame = at(pointing("/cameras/0/perspective/yfov", [0.5, 1.0]), tmp_path, 0.5)
    assert frame.camera.fov_degrees == pytest.approx(math.degrees(0.75))


@pytest.mark.parametrize("shown", [(1, 0), (0, 1)])
def test_nodes_appear_and_disappear(shown: tuple[int, int], tmp_path: Path) -> None:
    """The others keep their materials, and the order is that of the file."""
    pointer = "/nodes/0/extensions/KHR_node_visibility/visible"
    gltf = pointing(pointer, np.array(shown), "<u1", "STEP")
    counts = [len(at(gltf, tmp_path, time).meshes) for time in (0, 0.75, 1)]
    assert counts == [1 + shown[0], 1 + shown[0], 1 + shown[1]]
    assert material(at(gltf, tmp_path, float(shown[0]))).metallic == 0.5


def test_nothing_may_be_visible_for_a_while(tmp_path: Path) -> None:
    pointer = "/nodes/0/extensions/KHR_node_visibility/visible"
    gltf = pointing(pointer, np.array([1, 0]), "<u1", "STEP")
    gltf.document["scenes"][0]["nodes"].remove(1)
    ((_, frame),) = clrt.frames(clrt.load(gltf.write(tmp_path / "a.glb")), [24])
    assert not frame.meshes and not clrt.render(frame, spp=1, size=(4, 4)).report["warnings"]


@pytest.mark.parametrize(
    ("pointer", "values", "moved"),
    [
        ("/nodes/0/translation", [[0.0, 0, 0], [2, 0, 0]], [1, 0, 0]),
        ("/nodes/0/weights", [0.0, 1.0], [0.5, 0.5, 0.5]),
        ("/meshes/0/weights", [0.0, 1.0], [0.5, 0.5, 0.5]),
        ("/meshes/0/weights/0", [0.0, 1.0], [0.5, 0.5, 0.5]),
    ],
)
def test_nodes_and_morph_targets(pointer: str, values: NDArray[Any], moved: list[float], tmp_path: Path) -> None:
    gltf = pointing(pointer, values)
    gltf.document["meshes"][0]["weights"] = [0.0]
    assert at(gltf, tmp_path, 0.5).meshes[0].vertices == pytest.approx(TRIANGLE + np.array(moved))


def test_textures_move(tmp_path: Path) -> None:
    gltf = pointing(
        "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/offset", [[0.0, 0], [1, 2]]
    )
    png = io.BytesIO()
    Image.new("RGB", (1, 1)).save(png, "png")
    view = gltf.view(png.getvalue())
    gltf.document["images"] = [{"bufferView": view, "mimeType": "image/png"}]
    gltf.document["textures"] = [{"source": 0}]
    gltf.document["materials"][0]["pbrMetallicRoughness"] = {"baseColorTexture": {"index": 0}}
    uv = gltf.accessor(np.zeros((3, 2)))
    gltf.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uv
    color = material(at(gltf, tmp_path, 0.5)).color
    assert isinstance(color, clrt.Texture) and color.offset == pytest.approx((0.5, 1))


@pytest.mark.parametrize(
    "pointer",
    [
        "/materials/9/emissiveFactor",
        "/materials/0/name",
        "/nodes/0/mesh",
        "/nodes/0/extensions/KHR_novel/a",
        "/materials/0/extensions/KHR_materials_novel/novelFactor",
        "/materials/0/emissiveTexture/extensions/KHR_texture_transform/offset",
        "nodes/0/translation",
        "",
    ],
)
def test_what_is_not_supported_is_named(pointer: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        clrt.load(pointing(pointer, [0.0, 1.0]).write(tmp_path / "a.glb"), time=0.5)
    assert any(message.endswith(f'left out: "{pointer}" of animation "animation 0"') for message in caplog.messages)


@pytest.mark.programs
@pytest.mark.parametrize(
    ("pointer", "values"),
    [
        ("/materials/0/emissiveFactor", [[0.0, 0, 0], [9, 5, 1]]),
        *others(
            ("/materials/0/extensions/KHR_materials_transmission/transmissionFactor", [0.0, 1.0]),
            ("/extensions/KHR_lights_punctual/lights/0/intensity", [0.0, 900.0]),
        ),
    ],
)
def test_frames_are_the_images_of_their_scenes(pointer: str, values: Any, tmp_path: Path) -> None:
    """Also if a feature or a light is in some frames alone."""
    gltf = pointing(pointer, values)
    gltf.document["materials"][0]["pbrMetallicRoughness"] = {"metallicFactor": 0}
    gltf.document["nodes"][3]["translation"] = [0.3, 0.3, 5]
    path = gltf.write(tmp_path / "a.glb")
    options: dict[str, Any] = {"spp": 4, "size": (16, 16)}
    images = dict(clrt.animate(path, frames=[0, 12, 24], **options))
    assert len({image.pixels.tobytes() for image in images.values()}) == 3
    for number, still in clrt.frames(clrt.load(path), [0, 12, 24]):
        np.testing.assert_array_equal(images[number].pixels, clrt.render(still, **options).pixels)


def test_values_that_a_property_cannot_have(tmp_path: Path) -> None:
    path = pointing("/cameras/0/perspective/yfov", [1.0, -1.0]).write(tmp_path / "a.glb")
    with pytest.raises(SceneError, match="a.glb: /cameras/0/perspective/yfov becomes -0.5: Input should be greater"):
        clrt.load(path, time=0.75)
    path = pointing("/materials/0/emissiveFactor", [0.0, 1.0]).write(tmp_path / "a.glb")
    with pytest.raises(SceneError, match='animation "animation 0", /materials/0/emissiveFactor: accessor .* is SCALAR'):
        clrt.load(path, time=0.75)


def test_files_may_require_it(tmp_path: Path) -> None:
    gltf = ball()
    gltf.document["extensionsRequired"] = ["KHR_animation_pointer"]
    assert clrt.load(gltf.write(tmp_path / "a.glb")).meshes
