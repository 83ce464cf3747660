"""Queries and scenes can be pickled, copied and sent to another process."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.device.open import Device
from clrt.errors import DeviceError
from clrt.rendering.checkpoint.identity import scene_hash

from ..covering import covering

RNG = np.random.default_rng(8)
VERTICES, FACES = RNG.random((60, 3)), RNG.integers(0, 60, (120, 3))
SPHERES = np.hstack([RNG.random((20, 3)), np.full((20, 1), 0.05)])
RAYS = RNG.random((300, 3)), RNG.normal(size=(300, 3))
PLACES = np.concatenate([np.tile(np.eye(3), (5, 1, 1)), RNG.normal(size=(5, 3, 1))], axis=2)
SCENES = sorted((Path(__file__).parents[2] / "scenes").glob("*.toml"))

COPIES: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda each: pickle.loads(pickle.dumps(each)),
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
}
#: Query options: each layout, and other state that a copy must keep.
OPTIONS: dict[str, dict[str, Any]] = {
    **{layout: {"layout": layout} for layout in ("bvh8", "bvh2", "cwbvh", "packs", "list")},
    "ploc": {"builder": "ploc"},
    "spheres": {"spheres": SPHERES},
    "pool": {"traversal": "pool"},
}


def instanced(device: Device, **options: Any) -> clrt.InstancedRayQuery:
    return clrt.InstancedRayQuery(
        [(VERTICES, FACES), (VERTICES[::-1], FACES[:50])], [0, 1, 0, 1, 1], PLACES, device=device.info.index, **options
    )


def query(device: Device, **options: Any) -> clrt.RayQuery:
    return clrt.RayQuery(VERTICES, FACES, device=device.info.index, **options)


def assert_same(one: Any, other: Any) -> None:
    for name in ("closest_hit", "any_hit"):
        np.testing.assert_array_equal(getattr(one, name)(*RAYS), getattr(other, name)(*RAYS))
    for found, expected in zip(one.all_hits(*RAYS), other.all_hits(*RAYS)):
        np.testing.assert_array_equal(found, expected)


@pytest.mark.programs
@covering("name, how", OPTIONS, COPIES)
def test_a_copy_answers_the_same(device: Device, name: str, how: str) -> None:
    """Copies made before and after a query or a refit give the same hits and share no mutable state."""
    made = query(device, **OPTIONS[name])
    before = COPIES[how](made)
    assert_same(made, before)
    after, moved = COPIES[how](made), VERTICES[::-1] * 1.5
    made.refit(moved)
    assert_same(before, after)
    again = COPIES[how](made)
    before.refit(moved)
    assert_same(made, before)
    assert_same(made, again)
    assert before.closest_hit(*RAYS)["t"].tobytes() != after.closest_hit(*RAYS)["t"].tobytes()


@pytest.mark.programs
@covering("layout, how", ["bvh8", "bvh2", "cwbvh"], COPIES)
def test_a_copy_of_instances(device: Device, how: str, layout: str) -> None:
    """A copy of instances gives the same hits, also if the original or the copy moves."""
    made = instanced(device, layout=layout)
    other = COPIES[how](made)
    made.move(PLACES[::-1])
    assert_same(other, instanced(device, layout=layout))
    other.move(PLACES[::-1])
    assert_same(made, other)


def test_another_process(device: Device) -> None:
    """A query pickled to a spawned process gives the same hits."""
    made = query(device)
    with ProcessPoolExecutor(1, get_context("spawn")) as processes:
        found = processes.submit(made.closest_hit, *RAYS).result()
    np.testing.assert_array_equal(found, made.closest_hit(*RAYS))


def test_a_device_that_is_not_there(device: Device) -> None:
    state = query(device).__getstate__()
    with pytest.raises(DeviceError, match="no usable device matches 'Babbage'"):
        clrt.RayQuery.__new__(clrt.RayQuery).__setstate__({**state, "_selector": "Babbage"})


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_scenes(path: Path) -> None:
    """Copies keep the scene hash, settings and cameras, and objects shared in the scene are shared in the copy."""
    scene = clrt.load(path)
    for how, make in COPIES.items():
        other = make(scene)
        assert scene_hash(other) == scene_hash(scene) and other.render == scene.render, how
        assert other.cameras == scene.cameras and other.materials.keys() == scene.materials.keys(), how
        users = [[mesh.material for mesh in each.meshes] for each in (scene, other)]
        shared = [[one is other for one in materials for other in materials] for materials in users]
        assert shared[0] == shared[1], how
