"""clrt gives the same results if the caller makes numpy raise all floating-point errors and warnings."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.device.open import Device

pytestmark = pytest.mark.statistics

SCENES = Path(__file__).parents[1] / "scenes"
SIZES = (1e-42, 1e-20, 1.0, 1e20, 1e36)
OPTIONS: list[dict[str, Any]] = [
    {},
    {"adaptive": True},
    {"integrator": "direct", "aovs": "albedo,normal,depth,position,direct,indirect,variance"},
    {"integrator": "local"},
    {"integrator": "depth"},
    {"filter": "gaussian"},
]


def strictly(work: Callable[[], Any]) -> Any:
    """Return the result of `work`, with every floating-point error and every warning raised."""
    with np.errstate(all="raise"), warnings.catch_warnings():
        warnings.simplefilter("error")
        return work()


@pytest.mark.parametrize("size", SIZES)
def test_queries(device: Device, size: float) -> None:
    """Query meshes and rays of all sizes, including NaN, infinite and zero rays."""
    rng = np.random.default_rng(2)
    vertices, faces = rng.random((60, 3)) * size, rng.integers(0, 60, (90, 3))
    origins, directions = rng.normal(size=(200, 3)) * size, rng.normal(size=(200, 3)) * rng.choice(SIZES, (200, 1))
    spheres = (rng.random((10, 4)) * size).astype(np.float32) + np.finfo(np.float32).smallest_subnormal
    origins[:3], directions[3:6] = [[np.nan, np.inf, -np.inf]], [[0, np.nan, np.inf]]
    t_max = rng.choice([0.0, 1e-42, 1.0, np.inf, np.nan], 200)

    def work() -> list[Any]:
        query = clrt.RayQuery(vertices, faces, device=device.info.index, spheres=spheres)
        many = clrt.InstancedRayQuery(
            [(vertices, faces)], [0, 0], np.stack([np.eye(3, 4), 2 * np.eye(3, 4)]), device=device.info.index
        )
        found: list[Any] = []
        for each in (query, many, pickle.loads(pickle.dumps(query))):
            found += [
                each.closest_hit(origins, directions, t_max),
                each.any_hit(origins, directions),
                *each.all_hits(origins, directions, t_max),
            ]
        query.refit(vertices[::-1])
        return [*found, query.closest_hit(origins, directions)]

    for one, other in zip(work(), strictly(work)):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@pytest.mark.parametrize("name", ["spheres", "instances", "materials", "dragon"])
def test_pictures(device: Device, tmp_path: Path, name: str, options: dict[str, Any]) -> None:
    """Load, render, save and compare scenes."""

    def work() -> Any:
        scene = clrt.load(SCENES / f"{name}.toml")
        image = clrt.render(scene, size=(24, 16), spp=4, device=device.info.index, **options)
        image.save(tmp_path / "a.exr")
        image.save(tmp_path / "a.png", view="agx")
        running = clrt.Renderer(scene, size=(24, 16), spp=4, device=device.info.index)
        *_, state = running.passes()
        running.look(scene.camera)
        return image.pixels, state.pixels, running.state().pixels, clrt.compare(image, tmp_path / "a.exr")["relmse"]

    for one, other in zip(work(), strictly(work)):
        np.testing.assert_array_equal(one, other)
