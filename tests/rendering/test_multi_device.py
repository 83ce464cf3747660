"""Several devices render one image: it equals that of a single device for any split of work and any failure."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyopencl as cl
import pytest

from clrt.device.launches.launch import Launches
from clrt.device.open import Device
from clrt.errors import DeviceError, KernelError
from clrt.rendering.accumulation import scene_on_device
from clrt.rendering.accumulation.device_worker import DeviceWorker
from clrt.rendering.accumulation.multi_device import MultiDeviceAccumulation
from clrt.rendering.accumulation.single_device import SingleDeviceAccumulation
from clrt.rendering.renderer import Renderer

from ..covering import covering, others
from .checkpoints import SIZE, renderer, run, same
from .test_checkpoint import interrupt_after
from .test_noise import room


def crew(device: Device, count: int = 2, **options: Any) -> Renderer:
    """Return a renderer that uses the same device `count` times, each with its own context, queue and programs."""
    given = {"size": SIZE, "seed": 1, "spp": 24, "checkpoint_seconds": 0.0, **options}
    return Renderer(room(), device=[device.info.index] * count, **given)


@pytest.fixture
def small_launches(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that a pass is many of them."""
    monkeypatch.setattr("clrt.rendering.accumulation.device_pool.FEWEST_TILES", 5)
    monkeypatch.setattr("clrt.rendering.accumulation.single_device.FEWEST_TILES", 5)
    monkeypatch.setattr("clrt.device.launches.launch.TARGET_SECONDS", 1e-9)


@covering("adaptive, stops, count", [False, True], [{"spp": 40}, {"error": 0.1}], [2, 3], strength=2)
def test_same_picture(device: Device, adaptive: bool, stops: dict[str, float], count: int) -> None:
    """Image, estimates and the stop at an error are equal bit for bit; at least two devices took part."""
    alone, together = renderer(device, adaptive=adaptive), crew(device, count, adaptive=adaptive)
    run(alone, **stops)
    run(together, **stops)
    assert isinstance(alone.session, SingleDeviceAccumulation)
    assert isinstance(together.session, MultiDeviceAccumulation) and same(alone, together)
    assert sum(worker.samples > 0 for worker in together.session.workers) >= 2


@pytest.mark.parametrize("adaptive", [False, *others(True)], ids=["even", "adaptive"])
def test_interrupted_it_goes_on_alone_and_together(
    device: Device, tmp_path: Path, small_launches: None, adaptive: bool
) -> None:
    """Checkpoints of one, two and three devices resume from each other, also inside a pass."""
    at_once = renderer(device, adaptive=adaptive)
    run(at_once, spp=24)
    rng, hops, in_hand = np.random.default_rng(5), 0, 0
    while True:
        running = crew(device, 1 + hops % 3, adaptive=adaptive, checkpoint=tmp_path / "a.ck", resume=True)
        interrupt_after(running, int(rng.integers(3, 20)))
        run(running, spp=24)
        if running.stop_reason != "interrupted":
            break
        in_hand += bool(running.session.work.parts)
        hops += 1
    assert hops > 4 and in_hand > 2 and same(at_once, running)


@pytest.mark.parametrize("count", [2, *others(1)])
def test_passes_left_after_any_launch(device: Device, small_launches: None, count: int) -> None:
    """Each sample is added once if a pass is left after any launch, including the last."""
    whole = crew(device, count).session
    launches = sum(1 for _ in whole.render(4))
    expected = whole.film().pixels.tobytes()
    for left_after in range(1, launches + 1):
        session = crew(device, count).session
        begun = session.render(3)
        for _ in range(left_after):
            next(begun, None)
        begun.close()  # type: ignore[attr-defined]
        while session.samples_done < 4:
            list(session.advance(lambda done: 4 - done))
        assert session.film().pixels.tobytes() == expected


@covering("when, where", [2, 5, 9, 14], ["begin", "ended"])
def test_one_that_fails_is_left_out(
    device: Device,
    small_launches: None,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
    when: int,
    where: str,
) -> None:
    """If a device fails at any time, its shares are rendered again, including those in flight."""
    at_once = renderer(device)
    run(at_once, spp=24)
    running = crew(device, 3)
    assert isinstance(running.session, MultiDeviceAccumulation)
    _fail_after(running.session.workers[1], where, when, monkeypatch)
    run(running, spp=24)
    assert len(running.session.workers) == 2
    assert same(at_once, running) and caplog.text.count("is excluded: out of order") == 1
    assert [entry["lost"] for entry in running.session.shares()] == [False, False, True]


def test_none_left(device: Device, small_launches: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The render ends with the last device's error, and resuming its checkpoint gives the same image."""
    at_once, running = renderer(device), crew(device, 2, checkpoint=tmp_path / "a.ck")
    run(at_once, spp=24)
    assert isinstance(running.session, MultiDeviceAccumulation)
    for when, worker in zip((12, 20), list(running.session.workers)):
        _fail_after(worker, "ended", when, monkeypatch)
    with pytest.raises(DeviceError, match="out of order"):
        run(running, spp=24)
    again = crew(device, 2, checkpoint=tmp_path / "a.ck", resume=True)
    run(again, spp=24)
    assert same(at_once, again)


def _fail_after(worker: DeviceWorker, where: str, calls: int, monkeypatch: pytest.MonkeyPatch) -> None:
    method, left = getattr(worker, where), [calls]

    def fails(*arguments: Any) -> Any:
        left[0] -= 1
        if left[0] < 0:
            raise DeviceError("out of order")
        return method(*arguments)

    monkeypatch.setattr(worker, where, fails)


def test_ctrl_c_among_the_notes_of_a_launch(
    device: Device, small_launches: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An interrupt between the updates of the launch list and of the share: nothing waits for a missing launch, and no
    sample is lost or counted twice."""
    at_once = renderer(device)
    run(at_once, spp=24)
    for method in ("_finish_one", "begin"):
        running, whole, left = crew(device, 2), getattr(Launches, method), [5]

        def disturbed(launches: Launches, *arguments: Any) -> None:
            left[0] -= 1
            if method == "begin" and left[0] == 0:
                raise KeyboardInterrupt
            whole(launches, *arguments)
            if left[0] == 0:
                raise KeyboardInterrupt

        with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
            patch.setattr(Launches, method, disturbed)
            run(running, spp=24)
        run(running, spp=24)
        assert same(at_once, running), method


@pytest.mark.parametrize(
    ("call", "error"),
    [("lent", cl.RuntimeError("OUT_OF_RESOURCES")), ("build", KernelError("it has no compiler"))],
    ids=repr,
)
def test_one_that_cannot_begin_is_left_out(
    device: Device, caplog: pytest.LogCaptureFixture, call: str, error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever its driver says while buffers or programs are made; alone it is an error of clrt's."""
    make, refused = vars(scene_on_device)[call], list[bool]()

    def refuse(*arguments: Any) -> Any:
        if not refused:
            refused.append(True)
            raise error
        return make(*arguments)

    monkeypatch.setattr(scene_on_device, call, refuse)
    running = crew(device, 2)
    assert len(running.session.shares()) == 1 and "is excluded" in caplog.text
    refused.clear()
    with pytest.raises((DeviceError, KernelError)):
        renderer(device)
