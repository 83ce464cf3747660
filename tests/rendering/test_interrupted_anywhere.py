"""An exception from a signal handler at any line: a resumed render gives the same result."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.device.open import Device
from clrt.rendering.renderer import Renderer

from .. import interrupted
from .test_noise import room

pytestmark = pytest.mark.processes

SIZE, SPP = (40, 24), 12
#: Random lines at which each call is interrupted.
PLACES = 40
#: Of the package, where there is state between two lines; not in callbacks of the garbage collector.
FOLDERS = tuple(str(Path(clrt.__file__).parent / name) for name in ("rendering", "queries", "accel"))


def run(call: Callable[[], object], last: int = -1) -> int:
    """Run `interrupted.run` on FOLDERS."""
    return interrupted.run(call, FOLDERS, last)


def places(lines: int) -> Iterator[int]:
    """Yield random line numbers up to `lines`."""
    yield from np.random.default_rng(lines).integers(1, lines + 1, PLACES).tolist()


@pytest.fixture
def small_launches(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that a pass is some of them."""
    monkeypatch.setattr("clrt.rendering.accumulation.device_pool.FEWEST_TILES", 5)
    monkeypatch.setattr("clrt.rendering.accumulation.single_device.FEWEST_TILES", 5)
    monkeypatch.setattr("clrt.device.launches.launch.TARGET_SECONDS", 1e-9)


def renderer(device: Device, count: int, adaptive: bool) -> Renderer:
    """Return a renderer that uses the same device once, or several times as a crew."""
    return Renderer(room(), device=[device.info.index] * count, size=SIZE, spp=SPP, adaptive=adaptive)


def finish(running: Renderer) -> Any:
    """Return the image's mean and each pixel's sample count."""
    *_, state = running.passes(spp=SPP)
    return np.concatenate([state.film.mean, state.film.pixels["count"][..., None]], axis=-1)


@pytest.mark.parametrize("adaptive", [False, True], ids=["even", "adaptive"])
@pytest.mark.parametrize("count", [1, 2])
def test_passes(device: Device, small_launches: None, count: int, adaptive: bool) -> None:
    """Interrupt twice, since recovery may be interrupted, too; past the uniform phase of an adaptive render."""
    expected = finish(renderer(device, count, adaptive))
    lines = run(lambda: finish(renderer(device, count, adaptive)))
    for place in places(lines):
        running = renderer(device, count, adaptive)
        run(lambda: list(running.passes(spp=SPP)), place)
        run(lambda: list(running.passes(spp=SPP)), max(1, place // 3))
        np.testing.assert_array_equal(finish(running), expected, f"interrupted at line {place} of {lines}")


@pytest.mark.parametrize("lens", [0.0, 0.2])
def test_look(device: Device, lens: float) -> None:
    """A renderer interrupted while it changes camera gives the same image there, also if a lens needs another
    program."""
    scene = room()
    there = replace(scene.camera, position=(0.3, 0.2, 4.0), aperture_radius=lens)
    other = Renderer(replace(scene, camera=there), device=device.info.index, size=SIZE, spp=SPP)
    expected = finish(other)
    lines = run(lambda: other.look(there))
    for place in places(lines):
        running = Renderer(scene, device=device.info.index, size=SIZE, spp=SPP)
        next(running.passes(spp=SPP))
        run(lambda: running.look(there), place)
        found = finish(running)
        if running.scene.camera == there:
            np.testing.assert_array_equal(found, expected, f"interrupted at line {place} of {lines}")


def test_refit(device: Device) -> None:
    """After an interrupted refit the BVH is that of the old or of the new vertices."""
    rng = np.random.default_rng(2)
    vertices, faces = rng.random((900, 3)), np.arange(900).reshape(-1, 3)
    rays = rng.random((2000, 3)), rng.normal(size=(2000, 3))
    moved = vertices[:, ::-1].copy()
    before, after = (
        clrt.RayQuery(points, faces, device=device.info.index, layout="bvh2", builder="ploc")
        for points in (vertices, moved)
    )
    expected = [each.closest_hit(*rays)["primitive"] for each in (before, after)]
    lines = run(lambda: before.refit(moved))
    for place in places(lines):
        query = clrt.RayQuery(vertices, faces, device=device.info.index, layout="bvh2", builder="ploc")
        run(lambda: query.refit(moved), place)
        found = query.closest_hit(*rays)["primitive"]
        assert any((found == each).mean() > 0.999 for each in expected), f"interrupted at line {place} of {lines}"
