"""Arrays lent to a device outlive the commands that use them, even if the launching code is interrupted."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import time
import weakref
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pyopencl as cl
import pytest

import clrt
from clrt.accel.build import build_tree
from clrt.device.launches import device_arrays, lent_memory as lending
from clrt.device.launches.data_parallel import DataParallel
from clrt.device.open import Device
from clrt.farm.orders import Order
from clrt.farm.share_renderer import ShareRenderer
from clrt.live.live_renderer import ImageRequest, LiveRenderer
from clrt.live.settings import Settings
from clrt.rendering.compile.choices import Choices
from clrt.scene.render_settings import Integrator

pytestmark = pytest.mark.processes

RNG = np.random.default_rng(5)
RAYS = RNG.normal(size=(2, 500, 3)).astype(np.float32)
MESH = RNG.random((50, 3)).astype(np.float32), RNG.integers(0, 50, (100, 3), dtype=np.int32)
#: Number of clrt's lines after a launch, in which it is recorded and waited for.
LINES = 160


class Gate:
    """Blocks commands that are enqueued while it is closed, until it is opened. Calls that would wait for them are
    interrupted instead."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.launched = self.closed = False
        self.lent: list[weakref.ref[Any]] = []
        self.at_launch: list[weakref.ref[Any]] = []
        self._bars: list[cl.UserEvent] = []
        enqueue, lend, copy, finish = cl.enqueue_nd_range_kernel, lending.lend, cl.enqueue_copy, DataParallel.finish

        def launch(queue: cl.CommandQueue, *arguments: Any) -> cl.Event:
            if self.closed:
                self._bars.append(bar := cl.UserEvent(queue.context))
                cl.enqueue_barrier(queue, wait_for=[bar])
                self.launched, self.at_launch = True, [each for each in self.lent if each() is not None]
            return enqueue(queue, *arguments)

        def unless_blocked(call: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
            if self._bars:
                raise KeyboardInterrupt
            return call(*arguments, **named)

        def noted(device: Device, array: Any, access: int) -> lending.LentBuffer:
            self.lent.append(weakref.ref(array))
            return lend(device, array, access)

        monkeypatch.setattr(cl, "enqueue_nd_range_kernel", launch)
        monkeypatch.setattr(cl, "enqueue_copy", partial(unless_blocked, copy))
        monkeypatch.setattr(DataParallel, "finish", lambda work: unless_blocked(finish, work))
        monkeypatch.setattr(device_arrays, "lend", noted)
        monkeypatch.setattr("clrt.device.launches.launch.LONGEST_LOOK", 1e-3)

    def open(self) -> None:
        """Let all blocked commands begin."""
        self.closed = False
        while self._bars:
            self._bars.pop().set_status(cl.command_execution_status.COMPLETE)


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[Gate]:
    made = Gate(monkeypatch)
    yield made
    made.open()


def left(references: list[weakref.ref[Any]]) -> int:
    """Return how many of these objects still exist."""
    gc.collect()
    return sum(each() is not None for each in references)


def soon(condition: Callable[[], bool]) -> bool:
    end = time.perf_counter() + 20
    while not condition() and time.perf_counter() < end:
        time.sleep(1e-3)
    return condition()


def query(device: Device) -> clrt.RayQuery:
    return clrt.RayQuery(*MESH, device=device.info.index)


def scene() -> clrt.Scene:
    return clrt.Scene(
        meshes=[clrt.Mesh(*MESH)],
        spheres=[clrt.Sphere(center=(x, 0.0, 0.0), radius=0.4) for x in range(-4, 5)],
        environment=clrt.Environment(color=(1.0, 1.0, 1.0)),
        lights=[clrt.PointLight(position=(0.0, 3.0, 0.0), intensity=(9.0, 9.0, 9.0))],
        render=clrt.RenderSettings(size=(40, 24), spp=8),
    )


def renderer(device: Device, count: int = 1, integrator: Integrator = "path") -> clrt.Renderer:
    return clrt.Renderer(scene(), integrator=integrator, device=[device.info.index] * count)


def first_hits(device: Device) -> Callable[[], object]:
    made = renderer(device)
    return partial(made.session.first_hits, made.scene, ["depth"])


def live(device: Device) -> Callable[[], object]:
    asked = ImageRequest(1, scene(), Settings(device=device.info.index), False)
    return lambda: list(LiveRenderer(lambda phase: None).states(asked, asked.size, 8))


def share(device: Device) -> Callable[[], object]:
    """Return a farm worker's part in an image."""
    made = ShareRenderer(Order(scene(), Choices(), 8, (device.info.index,)))
    return partial(made.share, np.arange(4, dtype=np.uint32), 0, 8, None)


#: Functions that prepare a call that runs launches.
USES: dict[str, Callable[[Device], Callable[[], object]]] = {
    "closest_hit": lambda device: partial(query(device).closest_hit, *RAYS),
    "any_hit": lambda device: partial(query(device).any_hit, *RAYS),
    "all_hits": lambda device: partial(query(device).all_hits, *RAYS),
    "renderer": lambda device: partial(list, renderer(device).passes()),
    "two devices": lambda device: partial(list, renderer(device, 2).passes()),
    "raster": lambda device: partial(list, renderer(device, integrator="raster").passes()),
    "first hits": first_hits,
    "build": lambda device: partial(build_tree, device, device.layout, "reinsertion", MESH[0][MESH[1]]),
    "window": live,
    "farm worker": share,
}


def returning(frame: FrameType | None) -> bool:
    """Return whether the frame belongs to the callback for a lent buffer that is gone."""
    while frame and frame.f_code is not lending._begin_return.__code__:
        frame = frame.f_back
    return frame is not None


def interrupted(use: Callable[[], object], gate: Gate, line: int) -> None:
    """Run `use` and raise KeyboardInterrupt `line` lines of clrt after the first launch; not in callbacks of weak
    references, where Python ignores exceptions: what they leave is done at the next launch."""
    passed = 0

    def trace(frame: FrameType, event: str, _: object) -> Any:
        nonlocal passed
        passed += gate.launched and event == "line"
        if passed > line and not returning(frame):
            passed = -(10**9)
            raise KeyboardInterrupt
        return trace if "/clrt/" in frame.f_code.co_filename else None

    gate.closed = True
    before = sys.gettrace()
    sys.settrace(trace)
    try:
        with suppress(KeyboardInterrupt):
            use()
    finally:
        sys.settrace(before)


@pytest.mark.parametrize("name", USES)
def test_interrupted_at_any_line(device: Device, gate: Gate, name: str) -> None:
    """After an interrupt, every array that a launch may use survives until it ends, and is then freed."""
    if device.info.type != "cpu":
        pytest.skip("arrays are lent to CPUs alone")
    USES[name](device)()  # build its programs first
    for line in RNG.permutation(LINES)[:12]:
        gate.launched, gate.lent = False, []
        use = USES[name](device)
        interrupted(use, gate, int(line))
        used = gate.at_launch
        del use
        assert gate.launched and used and left(used) == len(used), line
        gate.open()
        assert soon(lambda: left(used) == 0), line


def test_memory_comes_back_by_itself(device: Device, gate: Gate) -> None:
    """Memory is freed at once from an idle device, and from a busy one when its launches end, without calling clrt."""
    if device.info.type != "cpu":
        pytest.skip("arrays are lent to CPUs alone")
    for busy in (False, True):
        gate.lent = []
        running = renderer(device)
        gate.closed = busy
        running.session.wait()
        next(running.session.render(1))
        if not busy:
            running.session.wait()
        assert left(gate.lent)
        del running
        assert bool(left(gate.lent)) == busy
        gate.open()
        assert soon(lambda: left(gate.lent) == 0)


LEAVING = """
import sys, clrt
scene = clrt.Scene(spheres=[clrt.Sphere()], environment=clrt.Environment(color=(1, 1, 1)))
def some():
    for number, state in enumerate(states):
        if number == 3:
            break
states = clrt.Renderer(scene, size=(128, 128), spp=10**6, device=int(sys.argv[1])).passes()
some()
if sys.argv[2] == "break":
    del states
    clrt.render(scene, size=(16, 16), spp=1, device=int(sys.argv[1]))
elif sys.argv[2] == "exception":
    raise RuntimeError("as it is meant")
"""


@pytest.mark.parametrize("how", ["break", "end", "exception"])
def test_process_lives(device: Device, how: str) -> None:
    """The process survives, also if Python exits with launches in flight, and prints no error of its own."""
    done = subprocess.run([sys.executable, "-c", LEAVING, str(device.info.index), how], capture_output=True, text=True)
    last = ["RuntimeError: as it is meant"] if how == "exception" else []
    assert done.returncode == len(last) and done.stderr.splitlines()[-1:] == last, done.stderr
    assert "ignored" not in done.stderr


def test_nothing_uses_memory_that_was_freed(device: Device) -> None:
    """Each array of 4 KiB or more is unmapped when it is freed, so a command that still uses it crashes."""
    unmapped = {"MALLOC_MMAP_THRESHOLD_": "4096", "MALLOC_TOP_PAD_": "0"}  # glibc's
    done = subprocess.run(
        [sys.executable, "-m", "tests.device.left_renders", str(device.info.index)],
        text=True,
        capture_output=True,
        env=os.environ | unmapped,
        cwd=Path(__file__).parents[2],
    )
    assert (done.returncode, done.stdout) == (0, "all left\n"), done.stderr
