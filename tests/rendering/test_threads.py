"""A renderer and a query shared by several threads: results equal those of one thread."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from threading import Barrier
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.device.open import Device
from clrt.rendering.renderer import Renderer

from .checkpoints import renderer, run, same
from .test_multi_device import crew


@pytest.mark.parametrize("adaptive", [False, True], ids=["even", "adaptive"])
@pytest.mark.parametrize("make", [renderer, crew], ids=["one device", "two devices"])
def test_threads_take_turns(device: Device, make: Any, adaptive: bool) -> None:
    """For any split of work the image is that of one thread bit for bit, and each thread's last state has it."""
    alone, shared, begin = make(device, adaptive=adaptive), make(device, adaptive=adaptive), Barrier(3)
    run(alone, spp=48)

    def work(renderer: Renderer) -> Any:
        begin.wait()
        return [state.pixels for state in renderer.passes(spp=48)][-1]

    with ThreadPoolExecutor(3) as threads:
        pictures = list(threads.map(work, [shared] * 3))
    np.testing.assert_array_equal(alone.session.film().pixels, shared.session.film().pixels)
    for picture in pictures:
        np.testing.assert_array_equal(picture, alone.state().pixels)
    assert same(alone, shared)


def test_another_view_comes_between_states(device: Device) -> None:
    """If another thread changes the camera, the following states show that view."""
    running, other = renderer(device), renderer(device)
    moved = replace(running.scene.camera, position=(0.3, 1.2, 2.5))
    other.look(moved)
    run(other, spp=32)
    with ThreadPoolExecutor(1) as thread:
        for number, _ in enumerate(running.passes(spp=32)):
            if number == 1:
                thread.submit(running.look, moved).result()
    np.testing.assert_array_equal(running.state().pixels, other.state().pixels)


def test_a_query_in_threads(device: Device) -> None:
    """Results equal those of one thread."""
    rng = np.random.default_rng(3)
    query = clrt.RayQuery(rng.random((50, 3)), rng.integers(0, 50, (100, 3)), device=device.info.index)
    rays = [rng.normal(size=(2, 400, 3)).astype(np.float32) for _ in range(16)]
    expected = [query.closest_hit(*each) for each in rays]
    with ThreadPoolExecutor(4) as threads:
        for one, two in zip(expected, threads.map(lambda each: query.closest_hit(*each), rays)):
            np.testing.assert_array_equal(one, two)
