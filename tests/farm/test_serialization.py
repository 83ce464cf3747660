"""Scenes are sent to workers completely, with each array once, and cannot make the receiver open a file."""

from __future__ import annotations

import os
import pickle
import sys
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

import numpy as np
import pytest

import clrt
from clrt.errors import SceneError
from clrt.farm.serialization import LARGE, pack, unpack
from clrt.rendering.checkpoint.identity import scene_hash
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import Instance, Mesh, Scene

SCENES = Path(__file__).parents[2] / "scenes"


@pytest.mark.parametrize("name", ["cornell", "glass", "instances", "materials", "furnace"])
def test_what_arrives_is_what_was_sent(name: str) -> None:
    scene = clrt.load(SCENES / f"{name}.toml")
    parcel = pack(scene)
    text, arrays = parcel.text, parcel.arrays
    arrived = unpack(text, arrays)
    assert scene_hash(arrived) == scene_hash(scene) and arrived.render == scene.render
    assert len(text) < 64 * LARGE and all(array.nbytes >= LARGE for array in arrays.values())


def test_a_sky_at_a_time_arrives() -> None:
    time = datetime(2026, 6, 21, 12, tzinfo=ZoneInfo("Europe/Berlin"))
    scene = Scene(environment=clrt.Sky(time=time, latitude=52.5, longitude=13.4).environment())
    parcel = pack(scene)
    assert scene_hash(unpack(parcel.text, parcel.arrays)) == scene_hash(scene)


def test_an_array_travels_once() -> None:
    """Meshes and frames share arrays: another camera adds no arrays."""
    rng = np.random.default_rng(1)
    vertices = rng.random((LARGE, 3), np.float32)
    faces = rng.integers(0, LARGE, (LARGE, 3), np.int32)
    texels = rng.integers(0, 255, (128, 128, 4), np.uint8)
    material = clrt.Diffuse(color=Texture(picture=Picture(texels)))
    meshes = [Mesh(vertices.copy(), faces, material, uv=vertices[:, :2].copy()) for _ in range(3)]
    scene = Scene(meshes=meshes, instances=[Instance(meshes[0])])
    parcel = pack(scene)
    text, arrays = parcel.text, parcel.arrays
    assert sorted(array.nbytes for array in arrays.values()) == sorted(
        [vertices.nbytes, faces.nbytes, texels.nbytes, vertices[:, :2].nbytes]
    )
    arrived = unpack(text, arrays)
    assert arrived.instances[0].mesh is arrived.meshes[0] and arrived.meshes[1].material is arrived.meshes[0].material
    moved = pack(replace(scene, camera=clrt.Camera(position=(1, 2, 3))))
    assert moved.arrays.keys() == arrays.keys() and moved.key != pack(scene).key


class Escape:
    """Object whose unpickling calls a function."""

    def __init__(self, function: Any, *arguments: Any) -> None:
        self.called = function, arguments

    def __reduce__(self) -> Any:
        return self.called


@pytest.mark.parametrize(
    "escape",
    [
        Escape(open, "/etc/passwd"),
        Escape(os.system, "true"),
        Escape(eval, "1"),
        Escape(clrt.load, "x.toml"),
        Escape(np.load, "x.npy"),
        Escape(pickle.loads, b"N."),
    ],
    ids=lambda escape: escape.called[0].__name__,
)
def test_a_text_calls_nothing(escape: Escape) -> None:
    """Only the classes of scenes and arrays may be named; anything else is refused before it is called."""
    with pytest.raises(SceneError, match="is not allowed in a scene"):
        unpack(pickle.dumps(escape), {})


def test_reading_a_parcel_opens_no_file() -> None:
    """Files of the scene are not opened either: their textures and meshes are in the parcel."""
    parcel = pack(clrt.load(SCENES / "materials.toml"))
    text, arrays = parcel.text, parcel.arrays
    unpack(text, arrays)  # load the modules
    opened: list[str] = []
    listening = [True]
    sys.addaudithook(
        lambda event, arguments: opened.append(event) if listening and event in ("open", "os.open") else None
    )
    unpack(text, arrays)
    listening.clear()
    assert not opened


def test_an_array_that_is_not_there() -> None:
    parcel = pack(np.zeros(LARGE))
    with pytest.raises(SceneError, match=f"lacks an array .{next(iter(parcel.arrays))}"):
        unpack(parcel.text, {})
