"""Cryptomatte layers: published hashes, coverage against geometry, and the files as the specification has them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import clrt
from clrt.device.open import Device
from clrt.rendering.accumulation.first_hits import ranked
from clrt.scene.cryptomatte import RANKS, header_entries, id_of, ids_of, murmur3

from .test_aov_files import layers


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("", 0),
        ("test", 0xBA6BD213),
        ("hello", 0x248BFA47),
        ("Hello, world!", 0xC0363E43),
        ("The quick brown fox jumps over the lazy dog", 0x2E4FF723),
    ],
)
def test_hashes_are_the_published_ones(text: str, value: int) -> None:
    assert murmur3(text.encode()) == value


def test_ids_are_normal_floats() -> None:
    """Also of the many names whose hashes are those of denormals, infinities and NaN."""
    names = [str(number) for number in range(5000)]
    assert any(murmur3(name.encode()) >> 23 & 255 in (0, 255) for name in names)
    ids = ids_of(names)
    assert np.isfinite(ids).all() and (np.abs(ids) >= np.finfo(np.float32).tiny).all()
    assert [hex(each) for each in ids.view(np.uint32)] == [hex(id_of(name)) for name in names]


@pytest.mark.parametrize("seed", range(10))
def test_ranks_are_shares_in_order(seed: int) -> None:
    random = np.random.default_rng(seed)
    hits = random.integers(-1, random.integers(1, 12), (4, 5, 16))
    ids = random.permutation(100)[:12].astype(np.float32) + 1
    pairs = ranked(hits, ids).reshape(4, 5, RANKS, 2)
    for pixel, found in zip(hits.reshape(-1, 16), pairs.reshape(-1, RANKS, 2)):
        shares = sorted((np.mean(pixel == number) for number in set(pixel.tolist()) - {-1}), reverse=True)
        np.testing.assert_allclose(found[:, 1], (shares + [0] * RANKS)[:RANKS])
        for each, share in found:
            assert (each == 0) == (share == 0)
            assert share == 0 or np.mean(ids[pixel][pixel >= 0] == each) * np.mean(pixel >= 0) == pytest.approx(share)


def test_an_image_without_surfaces_has_no_mattes() -> None:
    assert not ranked(np.full((2, 3, 16), -1), ids_of([])).any()


def test_mattes_cover_what_the_objects_do(device: Device, tmp_path: Path) -> None:
    """A sphere seen from afar covers a disc; with the one behind it, mattes add up to all that is not sky."""
    red, blue = clrt.Diffuse(color=(1, 0, 0)), clrt.Diffuse(color=(0, 0, 1))
    spheres = [
        clrt.Sphere(center=(0, 0, 0), radius=1, material=red, name="near"),
        clrt.Sphere(center=(0.8, 0, -3), radius=1, material=blue, name="far"),
        clrt.Sphere(center=(-2, 1.5, 0), radius=0.3, material=red, name="small"),
    ]
    camera = clrt.Camera(position=(0, 0, 1000), projection="orthographic", view_height=6)
    scene = clrt.Scene(spheres=spheres, camera=camera, materials={"red": red})
    image = clrt.render(
        scene,
        spp=1,
        size=(60, 60),
        filter="box",
        integrator="normals",
        aovs=["crypto_object", "crypto_material"],
        device=device.info.index,
    )
    image.save(tmp_path / "a.exr")
    header, channels = layers(tmp_path / "a.exr")
    manifests = {}
    for key in (key for key in header if key.endswith("/name")):
        entries = {part: header[f"{key.removesuffix('name')}{part}"] for part in ("hash", "conversion", "manifest")}
        assert entries["hash"] == "MurmurHash3_32" and entries["conversion"] == "uint32_to_float32"
        assert key.removesuffix("/name") == f"cryptomatte/{murmur3(header[key].encode()):08x}"[:19]
        manifests[header[key]] = json.loads(entries["manifest"])
    assert list(manifests["crypto_object"]) == ["near", "far", "small"]
    assert list(manifests["crypto_material"]) == ["red", "far"]

    def matte(layer: str, name: str) -> float:
        value = np.uint32(int(manifests[layer][name], 16)).view(np.float32)
        pairs = [("R", "G"), ("B", "A")]
        shares = [
            np.where(channels[f"{layer}{rank:02}.{first}"] == value, channels[f"{layer}{rank:02}.{second}"], 0)
            for rank in range(3)
            for first, second in pairs
        ]
        return float(np.sum(shares)) * 0.01  # the area of a pixel

    half = np.arccos(0.4)
    hidden = 2 * half - np.sin(2 * half)  # what two unit discs have in common, at a distance of .8
    expected = {"near": np.pi, "far": np.pi - hidden, "small": 0.09 * np.pi}
    for name, area in expected.items():
        assert matte("crypto_object", name) == pytest.approx(area, rel=0.01)
    assert matte("crypto_material", "red") == pytest.approx(expected["near"] + expected["small"], rel=0.01)
    assert image.report["cryptomatte"] == manifests


def test_entries_are_named_by_the_layer() -> None:
    entries = header_entries("crypto_object", {"cow": "0123abcd"})
    assert {key.rpartition("/")[0] for key in entries} == {f"cryptomatte/{murmur3(b'crypto_object'):08x}"[:19]}
