"""Reading of glTF files: containers, accessors, nodes, cameras, extensions."""

from __future__ import annotations

import logging
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from clrt.errors import SceneError
from clrt.formats.gltf.reader import read_gltf
from clrt.formats.load_scene import load
from clrt.scene.materials.material_types import MetallicRoughness
from clrt.scene.model import Model

from ..scene.shapes import cube, icosphere
from .glb import TRIANGLE, Gltf, ball, read

VERTICES, FACES = icosphere(0)


def corners(model: Model) -> NDArray[np.float32]:
    return np.concatenate([mesh.vertices[mesh.faces] for mesh in model.meshes])


@pytest.mark.parametrize("name", ["a.glb", "a.gltf"])
@pytest.mark.parametrize("dtype", ["<u1", "<u2", "<u4"])
def test_containers_and_index_types(name: str, dtype: str, tmp_path: Path) -> None:
    gltf = Gltf()
    gltf.mesh(attributes={"POSITION": gltf.accessor(VERTICES)}, indices=gltf.accessor(FACES.ravel(), dtype))
    (mesh,) = read(gltf, tmp_path, name).meshes
    np.testing.assert_array_equal(mesh.vertices, VERTICES)
    np.testing.assert_array_equal(mesh.faces, FACES)
    assert mesh.normals is None and mesh.material == MetallicRoughness(color=(1, 1, 1), metallic=1, roughness=1)


def test_file_names_are_percent_encoded(tmp_path: Path) -> None:
    gltf = ball()
    (tmp_path / "my data é.bin").write_bytes(gltf.data)
    gltf.write_with_uri(tmp_path / "a.gltf", "my%20data%20%C3%A9.bin")
    np.testing.assert_array_equal(corners(read_gltf(tmp_path / "a.gltf")), VERTICES[FACES])


def test_interleaved_vertices(tmp_path: Path) -> None:
    gltf = Gltf()
    rows = np.zeros(len(VERTICES), [("position", "<f4", 3), ("color", "<u4"), ("normal", "<f4", 3)])
    rows["position"], rows["normal"] = VERTICES, -VERTICES
    view = gltf.view(b"head" + rows.tobytes(), byteStride=rows.itemsize)
    attributes = {
        "POSITION": gltf.accessor(VERTICES, view=view, byteOffset=4),
        "NORMAL": gltf.accessor(VERTICES, view=view, byteOffset=20),
    }
    gltf.mesh(attributes=attributes, indices=gltf.accessor(FACES.ravel(), "<u1"))
    (mesh,) = read(gltf, tmp_path).meshes
    np.testing.assert_array_equal(mesh.vertices, VERTICES)
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals, -VERTICES, atol=1e-6)


@pytest.mark.parametrize(
    "dtype, normalized, expected",
    [
        ("<i1", True, [-1, -1, 0, 1]),
        ("<u1", True, [128 / 255, 129 / 255, 0, 127 / 255]),
        ("<i2", True, [-128 / 32767, -127 / 32767, 0, 127 / 32767]),
        ("<i1", False, [-128, -127, 0, 127]),
    ],
)
def test_quantised_positions(dtype: str, normalized: bool, expected: list[float], tmp_path: Path) -> None:
    """Specification 3.6.2.2: unsigned c / max, signed max(c / max, −1)."""
    gltf = Gltf()
    values = np.array([-128, -127, 0, 127]).astype(dtype)
    points = np.stack([values, np.roll(values, 1), np.roll(values, 2)], axis=1)
    gltf.document["extensionsRequired"] = ["KHR_mesh_quantization"]
    gltf.mesh(attributes={"POSITION": gltf.accessor(points, dtype, normalized=normalized)}, mode=5)
    (mesh,) = read(gltf, tmp_path).meshes
    np.testing.assert_allclose(mesh.vertices[:, 0], expected, rtol=1e-7)


@pytest.mark.parametrize("base", [True, False])
def test_sparse_accessor(base: bool, tmp_path: Path) -> None:
    gltf = Gltf()
    sparse = {
        "count": 2,
        "indices": {"bufferView": gltf.view(bytes([2, 5])), "componentType": 5121},
        "values": {"bufferView": gltf.view(np.array([[7, 8, 9], [4, 5, 6]], "<f4").tobytes())},
    }
    position = gltf.accessor(VERTICES, sparse=sparse)
    if not base:
        del gltf.document["accessors"][position]["bufferView"]
    gltf.mesh(attributes={"POSITION": position}, mode=6)
    (mesh,) = read(gltf, tmp_path).meshes
    expected = VERTICES * base
    expected[2], expected[5] = (7, 8, 9), (4, 5, 6)
    np.testing.assert_array_equal(mesh.vertices, expected)


@pytest.mark.parametrize(
    "mode, expected",
    [
        (4, [[0, 1, 2], [3, 4, 5]]),
        (5, [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]]),
        (6, [[1, 2, 0], [2, 3, 0], [3, 4, 0], [4, 5, 0]]),
    ],
)
def test_modes(mode: int, expected: list[list[int]], tmp_path: Path) -> None:
    """Specification 3.7.2.1: strips {i, i+1+(i mod 2), i+2−(i mod 2)}, fans {i+1, i+2, 0}."""
    gltf = Gltf()
    gltf.mesh(attributes={"POSITION": gltf.accessor(VERTICES[:6])}, mode=mode)
    np.testing.assert_array_equal(read(gltf, tmp_path).meshes[0].faces, expected)


@pytest.mark.parametrize("scale", [(1, 2, 3), (-1, 2, 3), (-1, -2, 0.5), (-1, -1, -1)])
def test_node_hierarchy(scale: tuple[float, float, float], tmp_path: Path) -> None:
    """A flat-shaded cube under three nodes: corners transformed step by step in float64, and normals that match the
    winding of the faces, mirrored or not."""
    vertices, faces = cube()
    split, normals = vertices[faces].reshape(-1, 3), np.repeat(vertices[faces].mean(axis=1).round(), 3, axis=0)
    gltf = Gltf()
    rng = np.random.default_rng(3)
    turns = rng.normal(size=(2, 4))
    inner = gltf.node(False, mesh=0, scale=scale, rotation=(turns[0] / np.linalg.norm(turns[0])).tolist())
    matrix = np.eye(4)
    matrix[:3] = rng.normal(size=(3, 4))
    middle = gltf.node(False, matrix=matrix.T.ravel().tolist(), children=[inner])
    gltf.node(translation=[5, 6, 7], rotation=(turns[1] / np.linalg.norm(turns[1])).tolist(), children=[middle])
    normal = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    primitive = {"attributes": {"POSITION": gltf.accessor(split), "NORMAL": gltf.accessor(normal)}}
    gltf.document["meshes"].append({"primitives": [primitive]})

    def place(points: NDArray[np.float64]) -> NDArray[np.float64]:
        points = Rotation.from_quat(turns[0]).apply(points * scale)
        points = points @ matrix[:3, :3].T + matrix[:3, 3]
        return np.asarray(Rotation.from_quat(turns[1]).apply(points) + [5, 6, 7])

    (mesh,) = read(gltf, tmp_path).meshes
    np.testing.assert_allclose(mesh.vertices, place(split.astype(np.float64)), atol=1e-5)
    a, b, c = mesh.vertices[mesh.faces].transpose(1, 0, 2)
    wound = np.cross(b - a, c - a)
    wound /= np.linalg.norm(wound, axis=1, keepdims=True)
    assert mesh.normals is not None
    np.testing.assert_allclose(mesh.normals[mesh.faces], np.repeat(wound[:, None], 3, axis=1), atol=1e-5)
    outward = a.astype(np.float64) - place(np.zeros((1, 3)))
    assert (np.einsum("ij,ij->i", outward, wound) > 0).all()


def test_corners(tmp_path: Path) -> None:
    """Both UV sets, colours in any format, and tangents; a mirrored node flips their bitangents."""
    rng = np.random.default_rng(2)
    uv, uv1 = rng.uniform(0, 1, (2, 3, 2)).astype(np.float32)
    colors = np.array([[255, 0, 0, 51], [0, 255, 0, 102], [0, 0, 255, 255]])
    gltf = Gltf()
    gltf.mesh(
        attributes={
            "POSITION": gltf.accessor(TRIANGLE),
            "NORMAL": gltf.accessor(np.tile([0, 0, 1], (3, 1))),
            "TANGENT": gltf.accessor(np.tile([1, 0, 0, 1], (3, 1))),
            "TEXCOORD_0": gltf.accessor(uv),
            "TEXCOORD_1": gltf.accessor(np.round(uv1 * 65535), "<u2", normalized=True),
            "COLOR_0": gltf.accessor(colors, "<u1", normalized=True),
        }
    )
    gltf.document["nodes"][0]["scale"] = [-1, 1, 1]
    (mesh,) = read(gltf, tmp_path).meshes
    assert mesh.uv is not None and mesh.uv1 is not None and mesh.colors is not None and mesh.tangents is not None
    assert np.array_equal(mesh.uv, uv) and np.abs(mesh.uv1 - uv1).max() < 1e-5
    assert np.allclose(mesh.colors, colors[:, :3] / 255)  # its material is opaque
    assert np.array_equal(mesh.tangents, np.tile([-1, 0, 0, -1], (3, 1)))


def cameras() -> Gltf:
    """Return a ball with cameras: one unnamed, one named by its node, one by itself, one
    orthographic, and an invalid one."""
    gltf = ball()
    gltf.document["cameras"] = [
        {"type": "orthographic", "name": "nothing"},
        {"type": "perspective", "perspective": {"yfov": 0.5}},
        {"type": "perspective", "perspective": {"yfov": 1.0}, "name": "side"},
        {"type": "orthographic", "name": "plan", "orthographic": {"xmag": 9, "ymag": -1.5}},
    ]
    gltf.node(camera=0)
    gltf.node(camera=1, translation=[10, 1, 0], rotation=[0, 0.5**0.5, 0, 0.5**0.5], scale=[2, 2, 2])
    gltf.node(camera=2, translation=[0, 0, 5])
    gltf.node(camera=1, translation=[0, 0, 9], name="side")
    gltf.node(camera=3, translation=[0, 0, 4], scale=[5, 5, 5])
    return gltf


def test_cameras(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A camera looks along its own −Z with +Y up (specification 3.10); the first is rotated to look along −X."""
    with caplog.at_level(logging.WARNING):
        found = read(cameras(), tmp_path).cameras
    assert list(found) == ["camera 1", "side", "side 2", "plan"]
    assert 'left out: camera "nothing", which has neither an angle nor a height' in caplog.text
    plan = found["plan"]
    assert (plan.projection, plan.view_height, plan.position) == ("orthographic", 3, (0, 0, 4))  # for any scale
    camera = found["camera 1"]
    view = np.subtract(camera.look_at, camera.position)
    assert camera.position == (10.0, 1.0, 0.0)
    assert camera.fov_degrees == pytest.approx(np.degrees(0.5))
    np.testing.assert_allclose(view, [-(101**0.5), 0, 0], atol=1e-12)  # at the distance of the ball
    np.testing.assert_allclose(camera.up, [0, 1, 0], atol=1e-15)
    assert (found["side"].position, found["side 2"].position) == ((0, 0, 5), (0, 0, 9))


def test_cameras_by_name(tmp_path: Path) -> None:
    """Cameras can be selected for a bare model and in a scene file, where they move with the model."""
    model = cameras().write(tmp_path / "a.glb")
    assert load(model).camera == load(model).cameras["camera 1"]
    assert load(model, "side 2").camera.position == (0, 0, 9)
    with pytest.raises(SceneError, match='a.glb: --camera: "Side" is unknown; did you mean "side"'):
        load(model, "Side")
    scene = tmp_path / "a.toml"
    placed = '[[mesh]]\nfile = "a.glb"\nscale = 2\nrotate_degrees = [0, 90, 0]\ntranslate = [1, 0, 0]\n'
    scene.write_text(f'[camera]\nname = "side"\n{placed}')
    camera = load(scene).camera
    np.testing.assert_allclose([camera.position, camera.look_at], [(11, 0, 0), (1, 0, 0)], atol=1e-12)
    assert load(scene, "side 2").camera.position[0] == 19
    scene.write_text(f'[camera]\nname = "sid"\nfov_degrees = 3\n{placed}')
    with pytest.raises(SceneError) as caught:
        load(scene)
    assert caught.value.problems == [
        f'{scene}: camera.name: "sid" is unknown; did you mean "side"?',
        f"{scene}: camera: has both a name and fov_degrees; keep one of them",
    ]
    scene.write_text('[camera]\nname = "side"\n')
    with pytest.raises(SceneError, match='"side" is unknown, as neither .cameras. nor a model file has one'):
        load(scene)


def compressed() -> Gltf:
    """Return a ball compressed with Draco, with positions to 2^-20 of its size; its normals point inward."""
    import DracoPy

    content = DracoPy.encode(
        VERTICES,
        FACES.astype(np.uint32),
        quantization_bits=20,
        preserve_order=True,
        normals=-VERTICES.astype(np.float64),
    )
    numbers = {attribute["attribute_type"]: attribute["unique_id"] for attribute in DracoPy.decode(content).attributes}
    count = len(DracoPy.decode(content).points)
    gltf = Gltf()
    gltf.document["accessors"] = [
        {"componentType": 5126, "count": count, "type": "VEC3"},
        {"componentType": 5126, "count": count, "type": "VEC3"},
        {"componentType": 5125, "count": FACES.size, "type": "SCALAR"},
    ]
    gltf.document["extensionsUsed"] = gltf.document["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    gltf.mesh(
        attributes={"POSITION": 0, "NORMAL": 1},
        indices=2,
        extensions={
            "KHR_draco_mesh_compression": {
                "bufferView": gltf.view(content),
                "attributes": {"POSITION": numbers[0], "NORMAL": numbers[1]},
            }
        },
    )
    return gltf


def test_draco(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        (mesh,) = read(compressed(), tmp_path).meshes
    np.testing.assert_allclose(mesh.vertices[mesh.faces], VERTICES[FACES], atol=1e-5)
    assert mesh.normals is not None and not caplog.text
    np.testing.assert_allclose(mesh.normals, -mesh.vertices, atol=1e-5)
    gltf = compressed()
    gltf.document["accessors"][1]["count"] = 11
    with pytest.raises(SceneError, match=r"accessor 1 has 11 elements, but the Draco data \d+; export"):
        read(gltf, tmp_path)
    gltf = compressed()
    gltf.data[8:] = bytes(len(gltf.data) - 8)
    with pytest.raises(SceneError, match='mesh "mesh 0": its Draco data cannot be decoded: '):
        read(gltf, tmp_path)


@pytest.mark.parametrize("dtype", ["<u1", "<u2"])
def test_draco_integers(dtype: str, tmp_path: Path) -> None:
    """Colors, weights and joints of every integer type that a primitive may have are those without compression."""
    import DracoPy

    rng = np.random.default_rng(8)
    most = np.iinfo(dtype).max
    colors = rng.integers(0, most + 1, (len(VERTICES), 4)).astype(dtype)
    joints = rng.integers(0, 2, (len(VERTICES), 4)).astype(dtype)
    weights = np.zeros((len(VERTICES), 4), dtype)
    weights[:, 0] = rng.integers(1, most, len(VERTICES))
    weights[:, 1] = most - weights[:, 0]
    given = {"COLOR_0": (colors, True), "JOINTS_0": (joints, False), "WEIGHTS_0": (weights, True)}

    def written(compress: bool) -> Gltf:
        gltf = Gltf()
        attributes = {"POSITION": gltf.accessor(VERTICES)}
        for name, (values, normalized) in given.items():
            attributes[name] = gltf.accessor(values, dtype, normalized=normalized)
        gltf.mesh(attributes=attributes, indices=gltf.accessor(FACES.ravel(), "<u2"), material=0)
        gltf.document["materials"] = [{"alphaMode": "BLEND"}]
        gltf.document["nodes"][0]["skin"] = 0
        gltf.document["skins"] = [{"joints": [gltf.node(), gltf.node(translation=[0, 0, 9])]}]
        if compress:
            numbers = {name: 10 + number for number, name in enumerate(given)}
            arrays = {numbers[name]: values for name, (values, _) in given.items()}
            content = DracoPy.encode(
                VERTICES, FACES.astype(np.uint32), 20, 1, preserve_order=True, generic_attributes=arrays
            )
            places = {each["attribute_type"]: each["unique_id"] for each in DracoPy.decode(content).attributes}
            gltf.document["meshes"][0]["primitives"][0]["extensions"] = {
                "KHR_draco_mesh_compression": {
                    "bufferView": gltf.view(content),
                    "attributes": numbers | {"POSITION": places[0]},
                }
            }
            count = len(DracoPy.decode(content).points)
            for accessor in gltf.document["accessors"][:-1]:
                accessor["count"] = count
        return gltf

    (plain,), (packed,) = (read(written(compress), tmp_path).meshes for compress in (False, True))
    assert plain.colors is not None and packed.colors is not None
    np.testing.assert_allclose(packed.vertices[packed.faces], plain.vertices[plain.faces], atol=1e-5)
    np.testing.assert_array_equal(packed.colors[packed.faces], plain.colors[plain.faces])
    np.testing.assert_allclose(plain.colors[plain.faces], colors[FACES] / most, rtol=1e-6)


def test_draco_without_its_decoder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error says what to install; an uncompressed copy is used if there is one."""
    gltf = compressed()
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    with pytest.raises(SceneError, match=r"decoder is not installed; pip install DracoPy, or export"):
        read(gltf, tmp_path)
    gltf = ball()
    gltf.document["meshes"][0]["primitives"][0]["extensions"] = {
        "KHR_draco_mesh_compression": {"bufferView": gltf.view(b"DRACO"), "attributes": {"POSITION": 0}}
    }
    np.testing.assert_array_equal(corners(read(gltf, tmp_path)), VERTICES[FACES])


def test_extensions(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Unsupported optional extensions are listed in one warning, required ones raise an error."""
    gltf = ball()
    gltf.document["extensionsUsed"] = ["EXT_b", "KHR_mesh_quantization", "EXT_a", "EXT_a"]
    with caplog.at_level(logging.WARNING):
        read(gltf, tmp_path)
    (warning,) = caplog.messages
    assert warning.endswith("left out: the extension EXT_a, the extension EXT_b")
    gltf.document["extensionsRequired"] = ["EXT_b", "EXT_c"]
    with pytest.raises(SceneError, match="needs the extension EXT_b, EXT_c, which is not supported"):
        read(gltf, tmp_path)


def test_invisible_nodes(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """They are left out, and so is what is below them."""
    gltf = ball()
    below = gltf.node(False, mesh=0, translation=[0, 0, 9])
    gltf.node(children=[below], extensions={"KHR_node_visibility": {"visible": False}})
    gltf.node(mesh=0, translation=[0, 0, -9], extensions={"KHR_node_visibility": {"visible": True}})
    gltf.document["extensionsUsed"] = ["KHR_node_visibility"]
    heights = [round(float(mesh.vertices[:, 2].mean())) for mesh in read(gltf, tmp_path).meshes]
    assert heights == [0, -9] and not caplog.text


def test_files_without_nodes_or_scenes(tmp_path: Path) -> None:
    gltf = ball()
    gltf.document["nodes"][0]["translation"] = [0, 0, 9]
    del gltf.document["scene"], gltf.document["scenes"]
    assert corners(read(gltf, tmp_path))[..., 2].min() > 7
    gltf.document["nodes"] = []
    np.testing.assert_array_equal(corners(read(gltf, tmp_path)), VERTICES[FACES])
