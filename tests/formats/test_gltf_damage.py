from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from clrt.errors import SceneError
from clrt.formats.gltf.reader import read_gltf

from .glb import Gltf, ball


def edited(*path: Any, value: Any) -> Gltf:
    gltf = ball()
    place: Any = gltf.document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return gltf


PRIMITIVE = ("meshes", 0, "primitives", 0)
BROKEN = {
    "version": (edited("asset", "version", value="1.0"), 'asset.version is "1.0"; only glTF 2'),
    "extension": (edited("extensionsRequired", value=["KHR_draco"]), "needs the extension KHR_draco, which is not"),
    "view end": (edited("bufferViews", 1, "byteLength", value=9999), "bufferView 1: ends at byte"),
    "view huge": (edited("bufferViews", 1, "byteLength", value=1e300), "bufferViews[1].byteLength: "),
    "accessor end": (edited("accessors", 0, "count", value=13), "accessor 0: needs 156 bytes of bufferView 0"),
    "accessor offset": (edited("accessors", 0, "byteOffset", value=4), "accessor 0: needs 148 bytes of bufferView 0"),
    "accessor type": (edited("accessors", 0, "type", value="VEC2"), "accessor 0 is VEC2, not VEC3"),
    "accessor view": (edited("accessors", 0, "bufferView", value=7), "accessor 0 uses bufferView 7, but the file"),
    "accessor none": (edited(*PRIMITIVE, "indices", value=5), "uses accessor 5, but the file has 2"),
    "component": (edited("accessors", 0, "componentType", value=5124), "accessors[0].componentType: "),
    "float index": (edited(*PRIMITIVE, "indices", value=0), "accessor 0 is VEC3, not SCALAR"),
    "signed index": (edited("accessors", 1, "componentType", value=5122), "accessor 1, are int16; they must"),
    "corners": (edited("accessors", 1, "count", value=58), "has 58 corners, which is not a multiple of 3"),
    "zeros": (
        edited("accessors", 0, value={"componentType": 5126, "count": 10**12, "type": "VEC3"}),
        "accessor 0: 1000000000000 elements without a bufferView",
    ),
    "cycle": (edited("nodes", 0, "children", value=[0]), "node 0: has two parents or is its own ancestor"),
    "child": (edited("nodes", 0, "children", value=[3]), "the scene uses node 3, but the file has 1"),
    "scene": (edited("scene", value=2), "the file uses scene 2, but the file has 1"),
    "mesh": (edited("nodes", 0, "mesh", value=2), "a node uses mesh 2, but the file has 1"),
    "material": (edited(*PRIMITIVE, "material", value=0), "uses material 0, but the file has 0"),
    "matrix": (edited("nodes", 0, "matrix", value=[1, 2, 3]), "nodes[0].matrix: "),
    "rotation": (edited("nodes", 0, "rotation", value=[0, 0, 0, 0]), "node 0: its rotation is [0, 0, 0, 0]"),
    "infinite": (edited("nodes", 0, "scale", value=[1e39, 1, 1]), 'mesh "mesh 0": vertices[0] = ['),
    "points": (edited(*PRIMITIVE, "mode", value=0), "contains no triangles"),
    "nothing": (edited("nodes", value=[{}]), "contains no triangles"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_documents(name: str, tmp_path: Path) -> None:
    gltf, sentence = BROKEN[name]
    with pytest.raises(SceneError) as caught:
        read_gltf(gltf.write(tmp_path / "a.glb"))
    (problem,) = caught.value.problems
    assert problem.startswith(f"{tmp_path / 'a.glb'}: ") and sentence in problem


def test_index_out_of_range(tmp_path: Path) -> None:
    gltf = Gltf()
    gltf.mesh(attributes={"POSITION": gltf.accessor(np.eye(3))}, indices=gltf.accessor(np.array([0, 1, 3]), "<u1"))
    with pytest.raises(SceneError, match=r'mesh "mesh 0": faces\[0\] uses vertex 3, but valid indices are 0 to 2'):
        read_gltf(gltf.write(tmp_path / "a.glb"))


@pytest.mark.parametrize("size, sentence", [(0, "document: "), (10, "truncated"), (30, "truncated"), (-4, "truncated")])
def test_cut_files(size: int, sentence: str, tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(ball().glb()[:size])
    with pytest.raises(SceneError, match=sentence):
        read_gltf(tmp_path / "a.glb")


@pytest.mark.parametrize(
    "uri, sentence",
    [
        ("lost.bin", 'cannot read the file "lost.bin"'),
        ("http://example.org/a.bin", "cannot read the file"),
        (".", "cannot read the file"),
        ("data:;base64,A", "not base64"),
        ("data:;base64,AAAA", "buffer 0: has 3 of its"),
    ],
)
def test_unreadable_buffers(uri: str, sentence: str, tmp_path: Path) -> None:
    ball().write_with_uri(tmp_path / "a.gltf", uri)
    with pytest.raises(SceneError, match=sentence):
        read_gltf(tmp_path / "a.gltf")


@settings(max_examples=200, deadline=None)
@given(
    edits=st.lists(
        st.tuples(
            st.floats(0, 1),
            st.one_of(st.binary(min_size=1, max_size=4), st.sampled_from([b"9", b"-", b"}", b"null", b"1e9"])),
        ),
        min_size=1,
        max_size=4,
    ),
    cut=st.booleans(),
)
def test_damaged_files_raise_only_scene_errors(
    edits: list[tuple[float, bytes]], cut: bool, tmp_path_factory: pytest.TempPathFactory
) -> None:
    content = bytearray(ball().glb())
    for place, new in edits:
        start = int(place * (len(content) - 1))
        content[start : start + len(new)] = new
    path = tmp_path_factory.getbasetemp() / "damaged.glb"
    path.write_bytes(content[: -int(edits[0][0] * 300) or None] if cut else content)
    try:
        meshes = read_gltf(path).meshes
    except SceneError as error:
        assert str(path) in str(error)
    else:
        assert all(np.isfinite(mesh.vertices).all() for mesh in meshes)
