"""A farm's image equals that of one machine bit for bit, also if workers die, sleep or return wrong results.

Scheduler and workers are separate processes, started once; tests replace those that they kill.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.device.device_info import Verdict
from clrt.device.discovery.check_results import keep_verdict
from clrt.device.open import Device
from clrt.device.programs.kernel_files import kernel_digest
from clrt.errors import DeviceError
from clrt.farm import dispatch
from clrt.farm.banded_picture import BandedPicture
from clrt.farm.cluster import Cluster, connect
from clrt.farm.farm_renderer import FarmRenderer
from clrt.farm.local_processes import Processes
from clrt.farm.orders import PictureOrder
from clrt.farm.whole_pictures import WholePictures
from clrt.output.images import read_image
from clrt.rendering.renderer import Renderer
from clrt.scene.model import Scene

from ..rendering.checkpoints import run, same
from ..rendering.test_clamps import clamped
from ..rendering.test_noise import room
from ..rendering.test_wavefront import catching

FAULTS = Path(__file__).with_name("faulty.py")
SIZE = (93, 70)
SCENES = Path(__file__).parents[2] / "scenes"


@pytest.fixture(scope="module")
def processes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Processes]:
    with Processes(tmp_path_factory.mktemp("farm")) as started:
        started.add_workers(4)
        yield started


@pytest.fixture
def small_tasks(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that a pass is many of them."""
    monkeypatch.setattr("clrt.farm.farm_picture.TASK_SECONDS", 0.02)
    monkeypatch.setattr("clrt.farm.farm_picture.FIRST_SAMPLES", 1 << 12)
    monkeypatch.setattr("clrt.farm.farm_picture.FEWEST_TILES", 5)


def alone(scene: Scene, **options: Any) -> Renderer:
    """Return a renderer in one process; the device is listed twice so that it uses the same program as the workers."""
    return Renderer(scene, device=[0, 0], **{"size": SIZE, "seed": 1, "spp": 24, **options})


def together(cluster: Cluster, scene: Scene, count: int = 4, **options: Any) -> FarmRenderer:
    """Return a farm renderer once `count` workers are ready."""
    made = FarmRenderer(scene, cluster, **{"device": 0, "size": SIZE, "seed": 1, "spp": 24, **options})
    made.session.dispatch.wait_for(count)
    return made


def at_pass(running: Renderer, number: int, event: Callable[[], Any], **stops: float) -> None:
    """Render to the end; call `event` in the middle of pass `number`."""
    passes, work = 0, running.session._work

    def disturbed() -> Iterator[None]:
        nonlocal passes
        passes += 1
        for turn, _ in enumerate(work()):
            if passes == number and turn == 1:
                event()
            yield

    running.session._work = disturbed  # type: ignore[method-assign]
    run(running, **stops)
    assert passes > number


@pytest.mark.parametrize(
    "scene",
    [
        clamped(room(), 0.5, 0.05),
        clrt.load(SCENES / "cornell.toml"),
        clrt.load(SCENES / "spheres.toml"),
        replace(catching(room()), name="catching"),
    ],
    ids=lambda scene: scene.name,
)
def test_same_picture(cluster: Cluster, small_tasks: None, scene: Scene) -> None:
    """Film, estimate and history are equal, and all four workers took part."""
    expected = alone(scene)
    run(expected, spp=40)
    found = together(cluster, scene)
    run(found, spp=40)
    assert same(expected, found) and sum(share["samples"] > 0 for share in found.session.shares()) == 4
    assert found.session.moved_bytes < 300 * found.session.film().samples


@pytest.mark.parametrize("adaptive", [False, True], ids=["even", "adaptive"])
def test_it_ends_at_the_same_error(cluster: Cluster, small_tasks: None, adaptive: bool) -> None:
    expected, found = alone(room(), adaptive=adaptive), together(cluster, room(), adaptive=adaptive)
    run(expected, error=0.1)
    run(found, error=0.1)
    assert found.stop_reason == "error" and same(expected, found)


def test_pictures_beside_it(cluster: Cluster) -> None:
    """AOVs and guides are rendered by a worker."""
    names = ["direct", "light_groups", "albedo", "depth"]
    expected, found = alone(room(), aovs=names), together(cluster, room(), 1, aovs=names)
    for name, picture in expected.aovs(run(expected, spp=4)).items():
        np.testing.assert_array_equal(picture, found.aovs(run(found, spp=4))[name])
    for name, guide in expected.session.guides().items():
        np.testing.assert_array_equal(guide, found.session.guides()[name])


def test_workers_that_are_killed(processes: Processes, cluster: Cluster, small_tasks: None) -> None:
    """Two of four workers die during a pass and two join: no sample is lost or counted twice."""

    def event() -> None:
        for _ in range(2):
            processes.kill(processes.workers[0])
        processes.add_workers(2)

    expected, found = alone(room()), together(cluster, room())
    run(expected, spp=512)
    at_pass(found, 6, event, spp=512)
    assert same(expected, found) and len(processes.workers) == 4


def test_one_that_sleeps(processes: Processes, cluster: Cluster, small_tasks: None) -> None:
    """Others do the tasks of a suspended worker; its late results after it wakes up are ignored."""
    expected, found = alone(room()), together(cluster, room())
    run(expected, spp=128)
    sleeper = processes.workers[-1]
    try:
        at_pass(found, 6, lambda: os.kill(sleeper.pid, signal.SIGSTOP), spp=64)
    finally:
        os.kill(sleeper.pid, signal.SIGCONT)
    run(found, spp=128)
    assert same(expected, found)


def test_those_that_lie_are_left_out(
    processes: Processes, cluster: Cluster, small_tasks: None, caplog: pytest.LogCaptureFixture
) -> None:
    """A worker with another version and one that returns NaN are named with the fault."""
    processes.add_workers(1, FAULTS, CLRT_TEST_FAULT="version")
    processes.add_workers(1, FAULTS, CLRT_TEST_FAULT="nan")
    liars = processes.workers[-2:]
    expected, found = alone(room()), together(cluster, room(), 5)
    run(expected, spp=40)
    run(found, spp=40)
    for liar in liars:
        processes.kill(liar)
    assert same(expected, found)
    assert "it runs clrt 0.0.1 with the kernels" in caplog.text
    assert f"this client clrt {clrt.__version__} with the kernels" in caplog.text
    assert "it returned pixels that are not finite" in caplog.text


@pytest.mark.parametrize("devices", [1, 2])
def test_a_device_that_is_lost(
    processes: Processes, cluster: Cluster, small_tasks: None, devices: int, caplog: pytest.LogCaptureFixture
) -> None:
    """The worker continues with its other device, or is excluded if it has none."""
    processes.add_workers(1, FAULTS, CLRT_TEST_FAULT="lost")
    expected, found = alone(room()), together(cluster, room(), 5, device=[0] * devices)
    run(expected, spp=40)
    run(found, spp=40)
    processes.kill(processes.workers[-1])
    assert same(expected, found)
    assert sum(share["lost"] for share in found.session.shares()) == (devices == 1)
    assert ("is excluded: the device is lost" in caplog.text) == (devices == 1)


def test_a_device_that_failed_its_check(
    processes: Processes,
    cluster: Cluster,
    device: Device,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """A worker without another device is excluded."""
    with monkeypatch.context() as there:
        there.setenv("CLRT_CACHE_DIR", str(tmp_path))
        assert keep_verdict(device.info, Verdict(False, ["it adds wrong"], "2026-01-01T00:00:00", 1.0, kernel_digest()))
    processes.add_workers(1, CLRT_CACHE_DIR=str(tmp_path))
    expected, found = alone(room()), together(cluster, room(), device=None)
    run(expected, spp=8)
    found.session.dispatch.wait_for(4)
    while "is excluded" not in caplog.text:
        found.session.dispatch.meet()
    run(found, spp=8)
    processes.kill(processes.workers[-1])
    assert same(expected, found) and "is excluded: no usable device passed its check" in caplog.text


def test_frames(cluster: Cluster) -> None:
    """24 frames, each rendered by one worker, equal those of one process, and all four workers took part."""

    def frame(name: str) -> PictureOrder:
        scene = room()
        moved = replace(scene.camera, position=tuple(np.add(scene.camera.position, (0, 0, int(name) / 100)).tolist()))
        return PictureOrder(replace(scene, camera=moved), {"size": (32, 24), "device": 0}, spp=8)

    names = [str(number) for number in range(24)]
    pictures = WholePictures(cluster, names, frame)
    pictures.dispatch.wait_for(4)
    found = dict(filter(None, pictures.results()))
    assert sorted(found) == sorted(names)
    assert sum(member.done > 0 for member in pictures.dispatch.everyone()) == 4
    for name in names:
        order = frame(name)
        expected = clrt.render(order.scene, spp=order.spp, **order.options)
        np.testing.assert_array_equal(found[name]["pixels"], expected.pixels)


def test_bands(cluster: Cluster, tmp_path: Path) -> None:
    """After an interrupt and damage to one band, an image in bands equals that of one process, in every file format."""
    order = PictureOrder(room(), {"size": (90, 100), "device": 0, "seed": 3, "clamp_direct": 0.5}, spp=4)
    banded = BandedPicture(order, tmp_path / "a.bands", band_pixels=90 * 16)
    for done, _ in banded.render(cluster):
        if done >= 3:
            break
    with open(banded.rows_path, "r+b") as file:
        file.seek(min(int(name.split()[1]) for name in banded.reports) * 90 * 12)
        file.write(b"damaged")
    kept = len(banded.reports)
    again = BandedPicture(order, tmp_path / "a.bands", band_pixels=90 * 16)
    counts = [done for done, _ in again.render(cluster, resume=True)]
    assert counts[0] < kept and counts[-1] == 7
    expected = clrt.render(room(), size=(90, 100), seed=3, clamp_direct=0.5, spp=4, device=0)
    for name in ("a.exr", "b.hdr", "c.png"):
        expected.save(tmp_path / name)
        again.save(tmp_path / f"of_{name}", "srgb", 0.0, {})
        np.testing.assert_array_equal(read_image(tmp_path / f"of_{name}"), read_image(tmp_path / name))
    assert again.summary()["samples"] == 4 * 90 * 100
    assert again.summary()["noise"] == pytest.approx(expected.report["noise"], rel=0.1)
    assert 0 < again.summary()["clamped_part"] == pytest.approx(expected.report["clamped_part"], rel=1e-5)
    assert again.summary()["warnings"] == expected.report["warnings"] != []


@pytest.mark.parametrize("behind", [None, np.random.default_rng(6).random((30, 20, 3)).astype(np.float32)])
def test_bands_and_frames_with_alpha(cluster: Cluster, tmp_path: Path, behind: NDArray[np.float32] | None) -> None:
    """Bands and whole images by workers are those of one process: with alpha, or each over its part of a backdrop."""
    import OpenImageIO as oiio

    scene = catching(room())
    if behind is not None:
        settings = replace(scene.render, transparent=False)
        scene = replace(scene, render=settings, backdrop=clrt.Backdrop(image=behind))
    options: dict[str, Any] = {"size": (40, 60), "device": 0}
    expected = clrt.render(scene, spp=4, **options)
    assert expected.alpha is not None and 0 < expected.alpha.mean() < 1
    banded = BandedPicture(PictureOrder(scene, options, spp=4), tmp_path / "a.bands", band_pixels=40 * 16)
    assert [*banded.render(cluster)][-1] == (4, 4)
    for name in ("a.exr", "c.png", "d.webp"):
        expected.save(tmp_path / name)
        banded.save(tmp_path / f"of_{name}", "srgb", 0.0, {})
        one, other = (
            np.asarray(oiio.ImageBuf(str(tmp_path / each)).get_pixels(oiio.FLOAT)) for each in (name, f"of_{name}")
        )
        assert one.shape[2] == (4 if behind is None else 3)
        np.testing.assert_array_equal(one, other)
    options["seed"] = 2
    pictures = WholePictures(cluster, ["one"], lambda name: PictureOrder(scene, options, spp=4))
    found = [result for result in pictures.results() if result is not None]
    np.testing.assert_array_equal(clrt.Image(**found[0][1]).layers, clrt.render(scene, spp=4, **options).layers)


def test_a_scheduler_that_comes_back(
    processes: Processes, cluster: Cluster, small_tasks: None, caplog: pytest.LogCaptureFixture
) -> None:
    """The scheduler restarts during a pass with other workers: the render continues with its samples."""

    def event() -> None:
        processes.kill(processes.scheduler)
        for worker in list(processes.workers):
            processes.kill(worker)
        processes.scheduler = processes.start_scheduler()
        processes.add_workers(2)

    expected, found = alone(room()), together(cluster, room())
    run(expected, spp=128)
    at_pass(found, 6, event, spp=128)
    assert same(expected, found) and "answers again" in caplog.text
    assert sum(share["samples"] > 0 for share in found.session.shares() if share["lost"] is False) >= 1


def test_a_scheduler_that_is_killed(
    processes: Processes, cluster: Cluster, small_tasks: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The render ends with its samples in the checkpoint, which one machine resumes."""
    monkeypatch.setattr(dispatch, "GONE", 1.0)
    found = together(cluster, room(), 2, checkpoint=tmp_path / "a.ck", checkpoint_seconds=1e6)
    with pytest.raises(DeviceError, match="has not answered for 1 s"):
        at_pass(found, 6, lambda: processes.kill(processes.scheduler), spp=128)
    expected, resumed = alone(room()), alone(room(), checkpoint=tmp_path / "a.ck", resume=True)
    assert 0 < resumed.session.samples_done < 128
    run(expected, spp=128)
    run(resumed, spp=128)
    assert same(expected, resumed)


def test_a_task_that_kills(processes: Processes, small_tasks: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """A new scheduler at the same address is used, and a task that ends two workers is given up and named."""
    monkeypatch.setattr(dispatch, "MOST_DEATHS", 2)
    for worker in list(processes.workers):
        processes.kill(worker)
    processes.scheduler = processes.start_scheduler()
    processes.add_workers(2, FAULTS, CLRT_TEST_FAULT="crash")
    with connect(processes.address) as cluster:
        found = together(cluster, room(), 2)
        with pytest.raises(DeviceError, match=r"a task of \d+ tiles, samples \d+ to \d+ has killed 2 workers, last"):
            run(found, spp=8)
