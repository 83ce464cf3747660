"""Checkpoints: a resumed render equals the uninterrupted one."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clrt.device.open import Device
from clrt.errors import ClrtError, OutputError, UsageError
from clrt.rendering.checkpoint.checkpoint_file import write_checkpoint
from clrt.rendering.renderer import Renderer

from ..covering import covering, others
from .checkpoints import renderer, run, same


@pytest.fixture
def small_launches(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that a pass is many of them."""
    monkeypatch.setattr("clrt.rendering.accumulation.single_device.FEWEST_TILES", 9)
    monkeypatch.setattr("clrt.device.launches.launch.TARGET_SECONDS", 1e-9)


@pytest.mark.programs
@covering("stops, adaptive", [{"spp": 40}, {"error": 0.1}], [False, True])
def test_interrupted_again_and_again(
    device: Device, tmp_path: Path, small_launches: None, adaptive: bool, stops: dict[str, float]
) -> None:
    """Resume with a new renderer every few launches, inside and between passes; 40 samples are more than planned."""
    at_once = renderer(device, adaptive=adaptive)
    run(at_once, **stops)
    hops, running = 0, at_once
    for launches in _counts():
        running = renderer(device, adaptive=adaptive, checkpoint=tmp_path / "a.ck", resume=True)
        interrupt_after(running, launches)
        run(running, **stops)
        if running.stop_reason != "interrupted":
            break
        hops += 1
    assert hops > 4 and running.stop_reason == at_once.stop_reason and same(at_once, running)
    seconds = [entry["seconds"] for entry in running.history]
    assert seconds == sorted(seconds)


def _counts() -> Iterator[int]:
    rng = np.random.default_rng(3)
    while True:
        yield int(rng.integers(1, 12))


def interrupt_after(running: Renderer, launches: int) -> None:
    """Interrupt the renderer when work is cut for the given number of launches."""
    cut, left = running.session.work.cut, [launches]

    def counted(*arguments: Any, **limits: Any) -> Any:
        left[0] -= 1
        if left[0] == 0:
            running.interrupt()
        return cut(*arguments, **limits)

    setattr(running.session.work, "cut", counted)


@pytest.mark.parametrize("adaptive", [True, *others(False)], ids=["adaptive", "even"])
def test_from_whatever_was_written_on_the_way(
    device: Device, tmp_path: Path, small_launches: None, adaptive: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where nobody asked it to stop: checkpoints from all over the render lead to the same end."""
    monkeypatch.setattr("clrt.rendering.checkpoint.checkpoints.COST", 0)
    path: Path = tmp_path / "a.ck"
    written = []

    def write(to: Path, *content: Any, **how: Any) -> None:
        write_checkpoint(to, *content, **how)
        written.append(to.read_bytes())

    monkeypatch.setattr("clrt.rendering.checkpoint.checkpoints.write_checkpoint", write)
    at_once = renderer(device, adaptive=adaptive, checkpoint=path)
    run(at_once, spp=24)
    checkpoints = list(written)
    assert len(checkpoints) > 20
    in_hand = 0
    for content in checkpoints[:: len(checkpoints) // 8]:
        path.write_bytes(content)
        running = renderer(device, adaptive=adaptive, checkpoint=path, resume=True, checkpoint_seconds=1e9)
        in_hand += bool(running.session.work.parts)
        run(running, spp=24)
        assert same(at_once, running)
    assert in_hand > 2


def test_without_one_yet_it_begins(device: Device, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    running = renderer(device, checkpoint=tmp_path / "a.ck", resume=True)
    assert "does not exist yet" in caplog.text and run(running, spp=2).spp == 2
    caplog.clear()
    renderer(device, checkpoint=tmp_path / "a.ck")
    assert "will be replaced" in caplog.text


@pytest.mark.parametrize(
    "options, error",
    [
        ({"resume": True}, UsageError),
        ({"checkpoint": "no/such/folder/a.ck"}, OutputError),
        ({"checkpoint": "/"}, OutputError),
        ({"checkpoint": "a.ck", "checkpoint_seconds": float("nan")}, UsageError),
    ],
)
def test_mistakes(device: Device, options: dict[str, Any], error: type[ClrtError]) -> None:
    with pytest.raises(error):
        renderer(device, **options)


def test_a_link_stays_one_and_nothing_else_is_left(device: Device, tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    (tmp_path / "near.ck").symlink_to(tmp_path / "far" / "a.ck")
    running = renderer(device, checkpoint=tmp_path / "near.ck")
    run(running, spp=1)
    run(running, spp=2)
    assert (tmp_path / "near.ck").is_symlink() and sorted(os.listdir(tmp_path / "far")) == ["a.ck", "a.ck~"]
    assert run(renderer(device, checkpoint=tmp_path / "near.ck", resume=True), spp=1).spp == 2


def test_it_costs_little(device: Device, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The next checkpoint is due no sooner than fifty times the last one's write time."""
    now = [100.0]
    monkeypatch.setattr("clrt.rendering.checkpoint.checkpoints.time.perf_counter", lambda: now[0])
    running = renderer(device, checkpoint=tmp_path / "a.ck", checkpoint_seconds=30.0)
    checkpoints = running._checkpoints
    assert checkpoints is not None

    def slow(*content: Any, **how: Any) -> None:
        now[0] += 2.0

    monkeypatch.setattr("clrt.rendering.checkpoint.checkpoints.write_checkpoint", slow)
    run(running, spp=1)
    now[0] += 99.0
    assert not checkpoints.due
    now[0] += 1.5
    assert checkpoints.due


@pytest.mark.parametrize("adaptive", [False, True], ids=["even", "adaptive"])
def test_left_by_break(device: Device, tmp_path: Path, adaptive: bool) -> None:
    left = renderer(device, adaptive=adaptive, checkpoint=tmp_path / "a.ck", checkpoint_seconds=1e9)
    for state in left.passes(spp=24):
        if state.spp >= 4:
            break
    goes_on_to_the_same(device, tmp_path / "a.ck", adaptive)


@covering("launches, adaptive", [3, 17, 40, *range(5, 12)], [False, True])
def test_left_by_a_keyboard_interrupt(
    device: Device, tmp_path: Path, small_launches: None, adaptive: bool, launches: int
) -> None:
    """It is raised while waiting for a launch, in the middle of a pass or at its last launch."""
    left = renderer(device, adaptive=adaptive, checkpoint=tmp_path / "a.ck", checkpoint_seconds=1e9)
    raise_after(left, launches)
    with pytest.raises(KeyboardInterrupt):
        run(left, spp=24)
    goes_on_to_the_same(device, tmp_path / "a.ck", adaptive)


def raise_after(running: Renderer, launches: int) -> None:
    """Raise KeyboardInterrupt after the given number of launches."""
    launch, left = running.session._launches.add, [launches]  # type: ignore[attr-defined]

    def interrupted(*arguments: Any) -> None:
        launch(*arguments)
        left[0] -= 1
        if left[0] == 0:
            raise KeyboardInterrupt

    setattr(running.session._launches, "add", interrupted)  # type: ignore[attr-defined]


def goes_on_to_the_same(device: Device, path: Path, adaptive: bool) -> None:
    at_once = renderer(device, adaptive=adaptive)
    running = renderer(device, adaptive=adaptive, checkpoint=path, resume=True)
    assert 0 < running.session.film().samples < 24 * running.session.film().pixels.size
    run(at_once, spp=24)
    run(running, spp=24)
    assert same(at_once, running)


def test_work_that_was_cut_and_not_launched_is_kept(device: Device, tmp_path: Path, small_launches: None) -> None:
    """It is saved as work in progress; otherwise its samples would be missing from the film."""
    at_once = renderer(device)
    run(at_once, spp=24)
    left = renderer(device, checkpoint=tmp_path / "a.ck", checkpoint_seconds=1e9)
    cut, before = left.session.work.cut, iter(range(9))

    def interrupted(*arguments: Any, **limits: Any) -> Any:
        share = cut(*arguments, **limits)
        if next(before, None) is None:
            raise KeyboardInterrupt
        return share

    setattr(left.session.work, "cut", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run(left, spp=24)
    running = renderer(device, checkpoint=tmp_path / "a.ck", resume=True)
    assert running.session.work.parts
    run(running, spp=24)
    assert same(at_once, running)


def test_an_abandoned_picture_is_not_kept(device: Device, tmp_path: Path) -> None:
    left = renderer(device, checkpoint=tmp_path / "a.ck", checkpoint_seconds=1e9)
    for _ in left.passes(spp=24):
        left.abandon()
        break
    assert not (tmp_path / "a.ck").exists()
