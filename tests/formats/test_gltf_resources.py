"""Data of glTF files in URIs (RFC 2397) and in files next to them."""

from __future__ import annotations

import base64
import logging
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest
from hypothesis import given, strategies as st

from clrt.errors import SceneError
from clrt.formats.gltf.reader import read_gltf
from clrt.formats.gltf.resources import read_uri

from .glb import ball

MODEL = Path("model.gltf")


@given(st.binary(max_size=40), st.sampled_from(["data:", "DATA:", "Data:"]), st.booleans(), st.booleans())
def test_embedded_data(content: bytes, scheme: str, padded: bool, wrapped: bool) -> None:
    """Base64 in any case of the words, with parameters, without padding, in lines; or percent-encoded bytes."""
    text = base64.b64encode(content).decode().rstrip("=" * (not padded))
    text = "\n ".join(text[i : i + 8] for i in range(0, len(text), 8)) if wrapped else text
    for kind in (";base64", "application/octet-stream;base64", "image/png;charset=x;BASE64"):
        assert read_uri(MODEL, f"{scheme}{kind},{text}", "buffer 0") == content
        assert read_uri(MODEL, f"{scheme}{kind},{quote(text)}", "buffer 0") == content
    for kind in ("", "application/octet-stream", ";charset=utf-8"):
        assert read_uri(MODEL, f"{scheme}{kind},{quote(content)}", "buffer 0") == content


@pytest.mark.parametrize("uri", ["data:;base64,*", "data:;base64,A", "data:;base64"])
def test_data_that_is_wrong(uri: str) -> None:
    with pytest.raises(SceneError, match="buffer 0: (its data URI is not base64|cannot read the file)"):
        read_uri(MODEL, uri, "buffer 0")


@pytest.mark.parametrize(
    ("name", "uri"),
    [
        ("a b é.bin", "a%20b%20%C3%A9.bin"),
        ("a b é.bin", "a b é.bin"),
        ("50%25.bin", "50%25.bin"),
        ("sub/a.bin", "sub\\a.bin"),
        ("sub/a.bin", ".\\sub/a.bin"),
        ("sub/a.bin", "sub%5Ca.bin"),
    ],
)
def test_names_of_files(name: str, uri: str, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / name).write_bytes(b"content")
    assert read_uri(tmp_path / "a.gltf", uri, "buffer 0") == b"content" and not caplog.text


def test_names_in_another_case(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """They are read, with a warning if the file system distinguishes them."""
    (tmp_path / "Textures").mkdir()
    (tmp_path / "Textures" / "Wood.PNG").write_bytes(b"wood")
    distinguished = not (tmp_path / "textures").exists()
    with caplog.at_level(logging.WARNING):
        assert read_uri(tmp_path / "a.gltf", "textures\\wood.png", "image 3") == b"wood"
    assert ("a.gltf: no file textures/wood.png; using Wood.PNG" in caplog.text) == distinguished
    with pytest.raises(SceneError, match='image 3: cannot read the file "textures/stone.png"; put it next to'):
        read_uri(tmp_path / "a.gltf", "textures/stone.png", "image 3")


def test_a_byte_order_mark_is_skipped(tmp_path: Path) -> None:
    path = ball().write(tmp_path / "a.gltf")
    expected = read_gltf(path).meshes[0].vertices
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    np.testing.assert_array_equal(read_gltf(path).meshes[0].vertices, expected)
