"""Streams of meshopt against meshoptimizer's own encoder and decoder, and the specification's examples."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import meshopt
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from clrt.errors import SceneError
from clrt.formats.meshopt.attributes import decode_attributes
from clrt.formats.meshopt.filters import FILTERS
from clrt.formats.meshopt.indices import decode_sequence, decode_triangles
from clrt.formats.meshopt.streams import StreamError

from .glb import Gltf, ball, read

Bytes = NDArray[np.uint8]
Kind = Literal["noise", "walk", "floats", "sparse"]


def stream(content: bytes) -> Bytes:
    return np.frombuffer(content, np.uint8)


def elements(kind: Kind, count: int, stride: int, seed: int) -> Bytes:
    """Return elements (count, stride) that need all widths of differences, modes of channels and modes of control."""
    rng = np.random.default_rng(seed)
    if kind == "noise":
        return rng.integers(0, 256, (count, stride)).astype(np.uint8)
    if kind == "walk":
        return np.cumsum(rng.integers(-3, 4, (count, stride)), axis=0).astype(np.uint8)
    if kind == "floats":
        walk = np.cumsum(rng.normal(size=(count, stride // 4)), axis=0).astype(np.float32)
        return np.ascontiguousarray(walk).view(np.uint8)
    return np.where(rng.random((count, stride)) < 0.02, rng.integers(0, 256, (count, stride)), 7).astype(np.uint8)


@settings(max_examples=60, deadline=None)
@given(
    kind=st.sampled_from(["noise", "walk", "floats", "sparse"]),
    count=st.integers(1, 700),
    channels=st.integers(1, 64),
    seed=st.integers(0, 2**32 - 1),
    version=st.integers(0, 1),
    level=st.integers(0, 3),
)
def test_attributes(kind: Kind, count: int, channels: int, seed: int, version: int, level: int) -> None:
    expected = elements(kind, count, 4 * channels, seed)
    encoded = meshopt.encode_vertex_buffer_level(expected, level, version)
    np.testing.assert_array_equal(decode_attributes(stream(encoded), count, 4 * channels), expected)


def test_the_example_of_the_specification() -> None:
    """16 differences in 4 bits each, two of them with a byte of their own, in the first byte of the elements."""
    group = bytes.fromhex("175ff0bc77a9210034b5")
    encoded = bytes([0xA0, 2]) + group + bytes(3) + bytes(32)
    expected = [-1, -4, -3, 26, -91, 0, -6, 6, -4, -4, 5, -5, 1, -1, 0, 0]
    found = decode_attributes(stream(encoded), 16, 4)
    assert found[:, 0].tolist() == np.cumsum(expected).astype(np.uint8).tolist() and not found[:, 1:].any()


def grid(side: int) -> NDArray[np.uint32]:
    """Return the corners of a grid's triangles, which share edges."""
    corner = np.arange(side * side).reshape(side, side)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[:-1, 1:], corner[1:, 1:]
    return np.stack([a, b, c, b, d, c], axis=-1).ravel().astype(np.uint32)


@settings(max_examples=60, deadline=None)
@given(
    side=st.integers(2, 20),
    seed=st.integers(0, 2**32 - 1),
    share=st.sampled_from([0.0, 0.05, 1.0]),
    base=st.sampled_from([0, 2**32 - 500]),
)
def test_triangles(side: int, seed: int, share: float, base: int) -> None:
    """Of meshes whose triangles share edges, all, most or hardly any; the encoder may rotate their corners."""
    rng = np.random.default_rng(seed)
    corners = grid(side)
    corners = np.where(rng.random(len(corners)) < share, rng.integers(0, side * side, len(corners)), corners)
    corners = (corners + base).astype(np.uint32)
    encoded = meshopt.encode_index_buffer(corners)
    expected = meshopt.decode_index_buffer(encoded, len(corners), 4)
    found = decode_triangles(stream(encoded), len(corners))
    np.testing.assert_array_equal(found, np.asarray(expected).view(np.uint32).ravel())
    rotated = found.reshape(-1, 3)[:, [[0, 1, 2], [1, 2, 0], [2, 0, 1]]]
    assert (rotated == corners.reshape(-1, 1, 3)).all(axis=2).any(axis=1).all()


@settings(max_examples=60, deadline=None)
@given(steps=st.lists(st.integers(-(2**20), 2**20), min_size=1, max_size=300), start=st.integers(0, 2**29))
def test_sequences(steps: list[int], start: int) -> None:
    expected = (np.cumsum(steps) + start).astype(np.uint32) % np.uint32(2**29)
    encoded = meshopt.encode_index_sequence(expected)
    np.testing.assert_array_equal(decode_sequence(stream(encoded), len(expected)), expected)


@pytest.mark.parametrize("content, value", [("7f", 0x7F), ("8104", 0x201), ("e58e26", 624485)])
def test_numbers_of_seven_bits_per_byte(content: str, value: int) -> None:
    """The examples of the specification and of LEB128: the lowest bit selects a baseline, the second the sign."""
    found = decode_sequence(stream(b"\xd1" + bytes.fromhex(content) + bytes(4)), 1)
    assert found[0] == np.uint32((~(value >> 2) if value & 2 else value >> 2) & 0xFFFFFFFF)


def vectors(count: int) -> NDArray[np.float32]:
    found = np.random.default_rng(count).normal(size=(count, 4))
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True), np.float32)


def as_meshoptimizer_decodes(encoded: Bytes, name: str) -> Bytes:
    packed = meshopt.encode_vertex_buffer(encoded)
    found = meshopt.decode_vertex_buffer(packed, *encoded.shape, name)
    return np.asarray(found).view(np.uint8).reshape(encoded.shape)


@pytest.mark.parametrize("stride", [4, 8])
@pytest.mark.parametrize("name", ["OCTAHEDRAL", "COLOR"])
def test_octahedral_and_color_filters(name: str, stride: int) -> None:
    """To one unit in the last place, as the specification allows, for all numbers of bits."""
    values = vectors(2000)
    values[:, 3] = np.sign(values[:, 3])
    encode = meshopt.encode_filter_oct if name == "OCTAHEDRAL" else meshopt.encode_filter_color
    values = values if name == "OCTAHEDRAL" else np.abs(values)
    values[:, :3] /= np.linalg.norm(values[:, :3], axis=1, keepdims=True)
    dtype = ("<i" if name == "OCTAHEDRAL" else "<u") + str(stride // 4)
    for bits in range(2, 2 * stride + 1):
        encoded = np.ascontiguousarray(encode(values, stride, bits)).view(np.uint8).reshape(len(values), stride)
        found, expected = FILTERS[name][0](encoded), as_meshoptimizer_decodes(encoded, name)
        assert np.abs(found.view(dtype).astype(int) - expected.view(dtype)).max() <= 1
        if name == "OCTAHEDRAL" and bits == 2 * stride:
            error = found.view(dtype)[:, :3] / np.iinfo(dtype).max - values[:, :3]
            assert np.abs(error).max() < 3 * 2.0 ** (1 - bits)


def test_quaternion_filter() -> None:
    values = vectors(2000)
    for bits in range(4, 17):
        encoded = np.ascontiguousarray(meshopt.encode_filter_quat(values, 8, bits)).view(np.uint8).reshape(-1, 8)
        found, expected = FILTERS["QUATERNION"][0](encoded), as_meshoptimizer_decodes(encoded, "QUATERNION")
        assert np.abs(found.view("<i2").astype(int) - expected.view("<i2")).max() <= 1
    turned = found.view("<i2") / 32767
    assert np.abs(np.sum(turned * values, axis=1)).min() > 1 - 1e-4


@pytest.mark.parametrize("bits", [1, 15, 24])
def test_exponential_filter(bits: int) -> None:
    """Exactly, over 16 orders of magnitude."""
    values = vectors(1000) * 10.0 ** np.random.default_rng(bits).integers(-8, 8, (1000, 1))
    encoded = np.ascontiguousarray(meshopt.encode_filter_exp(values.astype(np.float32), bits)).view(np.uint8)
    encoded = encoded.reshape(1000, 16)
    found = FILTERS["EXPONENTIAL"][0](encoded)
    np.testing.assert_array_equal(found, as_meshoptimizer_decodes(encoded, "EXPONENTIAL"))


VALID = {
    "attributes": meshopt.encode_vertex_buffer_level(elements("walk", 300, 12, 1), 2, 0),
    "attributes 1": meshopt.encode_vertex_buffer_level(elements("floats", 300, 12, 1), 3, 1),
    "triangles": meshopt.encode_index_buffer(grid(8)),
    "indices": meshopt.encode_index_sequence(grid(8)),
}


def decode(kind: str, content: bytes, count: int, stride: int) -> Any:
    if kind.startswith("attributes"):
        return decode_attributes(stream(content), count, stride)
    return (decode_triangles if kind == "triangles" else decode_sequence)(stream(content), count)


@settings(max_examples=400, deadline=None)
@given(
    kind=st.sampled_from(sorted(VALID)),
    edits=st.lists(st.tuples(st.floats(0, 1), st.binary(min_size=1, max_size=4)), max_size=4),
    end=st.integers(-40, 40),
    count=st.one_of(st.just(0), st.integers(1, 2**40)),
    noise=st.none() | st.binary(max_size=60),
    channels=st.integers(1, 64),
)
def test_damaged_streams(
    kind: str, edits: list[tuple[float, bytes]], end: int, count: int, noise: bytes | None, channels: int
) -> None:
    """Whatever the bytes, StreamError or an array of the size that was asked for."""
    valid = VALID[kind]
    content = bytearray(valid if noise is None else valid[:1] + noise)
    for place, new in edits:
        start = int(place * len(content))
        content[start : start + len(new)] = new
    content = content[:end] if end < 0 else content + bytes(end)
    size = {"triangles": 294, "indices": 294}.get(kind, 300) if count == 0 else count
    stride = 12 if count == 0 else 4 * channels
    try:
        found = decode(kind, bytes(content), size, stride)
    except StreamError:
        return
    assert found.shape == ((size, stride) if kind.startswith("attributes") else (size,))


@pytest.mark.parametrize("kind", VALID)
def test_streams_of_another_length(kind: str) -> None:
    """Bytes that are missing or left over are noticed."""
    count = 300 if kind.startswith("attributes") else 294
    for content in (VALID[kind][:-9], VALID[kind][:5] + VALID[kind][9:], VALID[kind] + bytes(9), b"", VALID[kind][:1]):
        with pytest.raises(StreamError):
            decode(kind, content, count, 12)


def test_triangles_before_the_first() -> None:
    """An edge or a vertex that no triangle before has is an error."""
    for code, table in ((0x00, 0), (0xF0, 0x10)):
        with pytest.raises(StreamError, match="before the first"):
            decode_triangles(stream(bytes([0xE1, code, table]) + bytes(15)), 3)


def compress(gltf: Gltf, extension: str, attribute_version: int) -> Gltf:
    """Replace all buffer views by compressed ones, in front of a buffer without content."""
    views, old = gltf.document["bufferViews"], bytes(gltf.data)
    gltf.data.clear()
    for index, accessor in enumerate(gltf.document["accessors"]):
        view = views[index]
        content = stream(old[view["byteOffset"] : view["byteOffset"] + view["byteLength"]])
        stride = len(content) // accessor["count"]
        if accessor["type"] == "SCALAR":
            encoded, mode = meshopt.encode_index_buffer(content.view(f"<u{stride}").astype(np.uint32)), "TRIANGLES"
        else:
            encoded = meshopt.encode_vertex_buffer_level(content.reshape(-1, stride), 2, attribute_version)
            mode = "ATTRIBUTES"
        place = {"buffer": 0, "byteOffset": len(gltf.data), "byteLength": len(encoded)}
        facts = {**place, "byteStride": stride, "count": accessor["count"], "mode": mode}
        views[index] = {"buffer": 1, "byteLength": len(content), "extensions": {extension: facts}}
        gltf.data += encoded
    gltf.document["extensionsUsed"] = gltf.document["extensionsRequired"] = [extension]
    return gltf


@pytest.mark.parametrize("extension, version", [("EXT_meshopt_compression", 0), ("KHR_meshopt_compression", 1)])
def test_compressed_files(extension: str, version: int, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """They have the triangles of the uncompressed file, whose corners may be rotated; no message."""
    (expected,) = read(ball(), tmp_path).meshes
    (mesh,) = read(compress(ball(), extension, version), tmp_path).meshes
    np.testing.assert_array_equal(mesh.vertices, expected.vertices)
    assert [sorted(face) for face in mesh.faces.tolist()] == [sorted(face) for face in expected.faces.tolist()]
    assert not caplog.text


def facts(index: int, **changes: Any) -> Gltf:
    gltf = compress(ball(), "EXT_meshopt_compression", 0)
    gltf.document["bufferViews"][index]["extensions"]["EXT_meshopt_compression"] |= changes
    return gltf


@pytest.mark.parametrize(
    "gltf, sentence",
    [
        (facts(0, byteLength=20), "bufferView 0: its meshopt data cannot be decoded: it ends too early; export"),
        (facts(0, count=2**50), "bufferView 0: its meshopt data cannot be decoded: its .* bytes cannot contain"),
        (facts(0, byteStride=6), "its byteStride is 6; that of attributes is a multiple of 4 up to 256"),
        (facts(0, byteStride=4, filter="QUATERNION"), "its byteStride is 4, which its filter QUATERNION is not for"),
        (facts(0, byteOffset=2), "its first byte is 0x"),
        (facts(0, byteLength=9999), "bufferView 0: ends at byte 9999, but buffer 0 has"),
        (facts(0, mode="ATTRIBUTE"), "bufferViews.0..extensions.EXT_meshopt_compression.mode: "),
        (facts(1, byteStride=8), "its byteStride is 8; that of indices is 2 or 4"),
        (facts(1, count=59), "its 59 indices are not a multiple of 3"),
        (facts(1, mode="INDICES"), "its first byte is 0xe1, not 0xd1"),
    ],
)
def test_damaged_files(gltf: Gltf, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=sentence):
        read(gltf, tmp_path)
