"""Workers that forget a scene or leave during a request are replaced by others, and the render continues.

They are simulated: they sleep instead of rendering.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from clrt.cli.goal import Goal
from clrt.cli.progress_reporter import PlainProgress
from clrt.errors import UsageError
from clrt.farm import worker_tasks
from clrt.farm.banded_picture import BandedPicture
from clrt.farm.cluster import Cluster
from clrt.farm.farm_renderer import FarmRenderer
from clrt.farm.local_processes import Processes
from clrt.farm.orders import PictureOrder
from clrt.farm.worker_request import ask
from clrt.farm.worker_tasks import Answer
from clrt.scene.model import Camera

from ..rendering.checkpoints import run
from ..rendering.test_noise import room

SIZE = (64, 48)


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[Processes]:
    with Processes(tmp_path) as started:
        started.add_simulated(1)
        yield started


def sleeper(cluster: Cluster, seed: int, speed: float = 1e7) -> FarmRenderer:
    return FarmRenderer(room(), cluster, simulated=speed, size=SIZE, seed=seed, spp=64)


def test_a_scene_that_was_forgotten(cluster: Cluster, monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker keeps two; it is given the first anew, and none of its tasks counts as failed."""
    monkeypatch.setattr("clrt.farm.farm_picture.FIRST_SAMPLES", 1 << 12)
    first, *others = [sleeper(cluster, seed) for seed in range(1 + worker_tasks.MOST_KEPT)]
    assert run(first, spp=64).film.samples == 64 * SIZE[0] * SIZE[1] and first.session.dispatch.former
    assert others[0].session.guides() == {}, "it was forgotten in its turn"


def slowly_or_not(pid: int) -> Answer:
    """Return the process id, but hang in the process `pid`."""
    if os.getpid() == pid:
        time.sleep(60)
    return Answer(os.getpid())


def test_one_that_goes_while_it_is_asked(
    processes: Processes, cluster: Cluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The next worker answers."""
    renderer, leaver = sleeper(cluster, 0), processes.workers[0]
    processes.add_simulated(1)
    dispatch = renderer.session.dispatch
    dispatch.wait_for(2)
    at_work = next(
        each
        for each in dispatch.ready()
        if cluster.ask(each.address, each.address, partial(os.getpid)).result() == leaver.pid
    )
    monkeypatch.setattr(
        dispatch,
        "ready",
        lambda: sorted(
            (each for each in dispatch.members.values() if each.ready), key=lambda each: each is not at_work
        ),
    )
    meet, turns = dispatch.meet, 0

    def disturbed() -> None:
        nonlocal turns
        turns += 1
        if turns == 3:
            processes.kill(leaver)
        meet()

    monkeypatch.setattr(dispatch, "meet", disturbed)
    assert ask(dispatch, slowly_or_not, leaver.pid) == processes.workers[0].pid


def test_an_interrupt_before_any_sample(cluster: Cluster, capsys: pytest.CaptureFixture[str]) -> None:
    """An interrupt before the first sample is reported like any other."""
    renderer = sleeper(cluster, 0, speed=100.0)
    state = renderer.state()
    assert state.film.samples == 0
    PlainProgress().state(state, Goal(4, None, 0.1))
    assert "0 %" in capsys.readouterr().err


def test_a_checkpoint_is_of_one_camera(cluster: Cluster, tmp_path: Path) -> None:
    renderer = FarmRenderer(room(), cluster, simulated=1e6, size=SIZE, checkpoint=tmp_path / "a.ck")
    with pytest.raises(UsageError, match="create a renderer for each"):
        renderer.look(Camera(position=(0, 0, 2)))


def band(**differs: Any) -> dict[str, Any]:
    """Return the report of one band of half an image, with the fields that count for the whole."""
    return {
        "samples": 6144,
        "spp": 4,
        "rays": 10,
        "nonfinite_samples": 0,
        "noise": 0.1,
        "seconds": 1.0,
        "stop_reason": "spp",
        "kernel": {"features": ["LIGHTS"]},
        "brightest": 1.0,
        "light": 1.0,
        "warnings": ["of the scene"],
        **differs,
    }


def test_what_bands_say_together(tmp_path: Path) -> None:
    """Figures of a single band are not reported for the whole."""
    banded = BandedPicture(PictureOrder(room(), {"size": SIZE}, spp=4), tmp_path / "a.bands")
    banded.reports = {
        name: band(
            device="one",
            seconds=seconds,
            samples_per_second=6144 / seconds,
            rays_per_second=1.0,
            stop_reason="error",
            tile_noise=0.02,
        )
        for name, seconds in (("a", 1.0), ("b", 9.0))
    }
    told = banded.summary()
    assert told["worker_seconds"] == 10 and told["samples"] == 2 * 6144 and told["stop_reason"] == "error"
    assert not {"seconds", "samples_per_second", "rays_per_second", "tile_noise", "brightest", "light"} & set(told)
    banded.reports["b"]["stop_reason"] = "time"
    assert "stop_reason" not in banded.summary() and banded.summary()["warnings"] == ["of the scene"]


def test_bands_warn_of_the_whole_picture(tmp_path: Path) -> None:
    """Warnings cover the samples dropped in all bands, the bias of all, and an image that is black everywhere."""
    banded = BandedPicture(PictureOrder(room(), {"size": SIZE, "clamp_direct": 1.0}, spp=4), tmp_path / "a.bands")
    banded.reports = {
        "a": band(samples=100, nonfinite_samples=3, brightest=0.0, light=3.0, clamped_part=0.25),
        "b": band(samples=100, nonfinite_samples=4, light=1.0, clamped_part=0.5),
    }
    first, dropped, biased = banded.summary()["warnings"]
    assert first == "of the scene" and dropped.startswith("7 of 200 samples were not finite")
    assert biased.startswith("the image is biased by clamp_direct: 33.33% of the light was removed; the")
    banded.reports["b"]["brightest"] = 0.0
    assert banded.summary()["warnings"][3:] == [
        "the image is black: no light reaches what the camera sees; `clrt debug SCENE --pixel 32,24` shows why"
    ]
