"""Adaptive sampling: it lowers the error at equal cost, and its image does not depend on interruptions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.device.open import Device
from clrt.formats.load_scene import load
from clrt.output.image_error import relmse
from clrt.rendering.error_estimate.adaptive_sampling import FLOOR_SPP, worth_doubling
from clrt.rendering.film.tiles import TILE, over_pixels, tile_pixels, tile_sums, tiles_of
from clrt.rendering.renderer import Renderer, State
from clrt.scene.model import Scene

from .test_noise import outdoors, room

pytestmark = pytest.mark.statistics

SIZE = (61, 44)


def renderer(device: Device, scene: Scene, seed: int = 1, spp: int = 64, adaptive: bool = True) -> Renderer:
    """Return a renderer at SIZE with `spp` planned samples."""
    return Renderer(scene, device=device.info.index, size=SIZE, spp=spp, seed=seed, adaptive=adaptive)


def end(running: Renderer, **stops: float) -> State:
    """Render until these stop conditions hold and return the last state."""
    return list(running.passes(**stops))[-1]  # type: ignore[arg-type]


def truth(device: Device, scene: Scene) -> NDArray[np.float32]:
    """Return a reference image of many samples."""
    return end(renderer(device, scene, 99, 1024, adaptive=False), spp=1024).pixels


def test_tiles_of_a_picture_that_they_do_not_divide() -> None:
    """Sums and pixel counts per tile equal those of a loop over the pixels if the size is not a multiple of the
    tile's."""
    rng = np.random.default_rng(1)
    values, (rows, columns) = rng.random((SIZE[1], SIZE[0], 3)), tiles_of(SIZE)
    sums, pixels, numbers = np.zeros((rows, columns)), np.zeros((rows, columns)), rng.random((rows, columns))
    for y, x in np.ndindex(values.shape[:2]):
        sums[y // TILE, x // TILE] += values[y, x].sum()
        pixels[y // TILE, x // TILE] += 1
        assert over_pixels(numbers, SIZE)[y, x] == numbers[y // TILE, x // TILE]
    np.testing.assert_allclose(tile_sums(values), sums, rtol=1e-12)
    np.testing.assert_allclose(tile_sums(values[..., 0]) + tile_sums(values[..., 1:]), sums, rtol=1e-12)
    assert np.array_equal(tile_pixels(SIZE), pixels)


@pytest.mark.parametrize("most", [0, 15, 100, 3000, 1e9])
def test_what_is_worth_doubling(most: float) -> None:
    """No tile left out is worth more than a chosen one unless it did not fit in the budget; errors may be 0.

    A tile's error weighs as much as its four neighbours' errors together; the error is extended
    constantly at the border.
    """
    rng = np.random.default_rng(2)
    samples, rays = 2 ** rng.integers(4, 9, (5, 6)), rng.integers(0, 2000, (5, 6)).astype(float)
    errors = rng.exponential(size=(5, 6)) * (rng.random((5, 6)) > 0.2)
    chosen = worth_doubling(errors, rays, samples, most)
    smooth = np.array(
        [
            [
                (
                    errors[y, x]
                    + sum(
                        errors[min(max(y + i, 0), 4), min(max(x + j, 0), 5)]
                        for i, j in ((-1, 0), (1, 0), (0, -1), (0, 1))
                    )
                    / 4
                )
                / 2
                for x in range(6)
            ]
            for y in range(5)
        ]
    )
    costs, worth = samples.ravel(), (smooth / np.maximum(rays, 1)).ravel()
    left = np.setdiff1d(np.arange(samples.size), chosen)
    assert len(set(chosen)) == len(chosen) and costs[chosen].sum() <= most
    for tile in left:
        assert costs[tile] > most - costs[chosen[worth[chosen] >= worth[tile]]].sum()


@pytest.mark.parametrize("scene", [room(), outdoors()], ids=["room", "outdoors"])
def test_less_error_for_as_many_samples(device: Device, scene: Scene) -> None:
    """Adaptive sampling has less error at equal sample count, and the estimated error is within a factor of 1.4 of
    it."""
    expected, errors, told = truth(device, scene), {True: 0.0, False: 0.0}, []
    for seed in range(4):
        for adaptive in errors:
            state = end(renderer(device, scene, seed, adaptive=adaptive), spp=64)
            found = relmse(state.pixels, expected)
            assert found is not None and state.noise is not None
            errors[adaptive] += found
            told += [state.noise / found**0.5] if adaptive else []
    assert errors[True] < 0.95 * errors[False]
    assert 1 / 1.4 < min(told) and max(told) < 1.4


def test_samples_double_by_tiles(device: Device) -> None:
    """All pixels of a tile have the same power of two of samples, tiles differ, and the total is the requested
    number."""
    running = renderer(device, outdoors())
    state = end(running, spp=64)
    count = state.film.pixels["count"]
    assert np.array_equal(count, over_pixels(running.session.tile_samples, SIZE)) and state.film.nonfinite_samples == 0
    levels = np.unique(count)
    assert np.all(levels & levels - 1 == 0) and levels[0] >= FLOOR_SPP and levels[-1] >= 4 * levels[0]
    assert 0.97 * 64 * count.size < count.sum() <= 64 * count.size
    assert running.stop_reason == "spp" and state.spp == round(count.sum() / count.size)


def test_interrupted_and_cut_it_is_the_same_picture(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """The image is the same bit for bit if the render is split into many calls and stopped inside passes."""
    at_once = end(renderer(device, room()), spp=64).film.pixels
    running = renderer(device, room())
    monkeypatch.setattr("clrt.rendering.accumulation.single_device.FEWEST_TILES", 4)
    monkeypatch.setattr("clrt.device.launches.launch.TARGET_SECONDS", 1e-9)
    stops = 0
    while (state := end(running, spp=64, time=running.seconds + 1e-6)) and running.stop_reason == "time":
        stops += 1
    assert stops > 20 and state.film.pixels.tobytes() == at_once.tobytes()


@pytest.mark.parametrize("size", [SIZE, (8, 8), (12, 5)], ids=str)
def test_it_stops_at_an_error(device: Device, size: tuple[int, int]) -> None:
    """It stops at the requested error without planned samples, also for images of one or two tiles, doubled as a
    whole."""
    running = Renderer(outdoors(), device=device.info.index, size=size, seed=1, adaptive=True)
    state = end(running, error=0.01)
    assert running.stop_reason == "error" and state.noise is not None and state.noise <= 0.01 and state.spp > FLOOR_SPP


def test_the_scene_file_may_ask_for_it(tmp_path: Path) -> None:
    """The scene file's `adaptive` turns it on; the default is off."""
    file = tmp_path / "sky.toml"
    for text, asked in (("", False), ("adaptive = true", True)):
        file.write_text(f"[environment]\ncolor = [1, 1, 1]\n[render]\nspp = 1\n{text}\n")
        assert load(file).render.adaptive == asked
