"""Devices with small buffers: arrays in parts, the film on the host, and the same image."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pyopencl as cl
import pytest

from clrt.accel.methods import LayoutName
from clrt.device.buffer_limit import VARIABLE, largest_buffer
from clrt.device.memory_plan import OVERLAP, part_count, part_records, parts
from clrt.device.open import Device
from clrt.errors import NoRoomError, UsageError
from clrt.rendering.accumulation.denoiser_guides import render_guides
from clrt.rendering.accumulation.multi_device import MultiDeviceAccumulation
from clrt.rendering.accumulation.single_device import SingleDeviceAccumulation
from clrt.rendering.renderer import Renderer
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Mesh, Scene, Sphere
from clrt.scene.render_settings import Integrator

from ..covering import others
from .rays import icosphere
from .test_variants import everything, painted

pytestmark = pytest.mark.programs


def scene() -> Scene:
    """Return a scene with textures and enough spheres that they are stored in the BVH."""
    centers = np.random.default_rng(1).uniform(-3, 3, (400, 3))
    more = [Sphere(center=(float(x), float(y), float(z)), radius=0.05) for x, y, z in centers]
    full = painted(everything())
    return replace(full, spheres=[*full.spheres, *more])


def film(device: Device, layout: LayoutName, integrator: Integrator = "path") -> tuple[Renderer, bytes]:
    running = Renderer(scene(), device=device.info.index, layout=layout, spp=4, integrator=integrator)
    return running, list(running.passes(spp=4))[-1].film.pixels.tobytes()


@pytest.fixture(scope="module")
def whole(device: Device) -> tuple[Renderer, bytes]:
    return film(device, "bvh8")


@pytest.fixture(scope="module")
def whole_depth(device: Device) -> tuple[Renderer, bytes]:
    return film(device, "bvh8", "depth")


#: Layouts and the largest buffer in KiB.
LIMITS = [("bvh8", 24), ("bvh2", 8), ("cwbvh", 8), ("list", 8), ("packs", 12)]


@pytest.mark.parametrize(("layout", "limit"), [("bvh8", 8), *others(*LIMITS)])
def test_in_parts_it_is_the_same_picture(
    device: Device, whole: tuple[Renderer, bytes], monkeypatch: pytest.MonkeyPatch, layout: LayoutName, limit: int
) -> None:
    """Bit for bit, in every layout; no buffer exceeds the limit, and at 8 KiB most arrays fill several."""
    running = assert_same_in_parts(device, whole, monkeypatch, layout, limit)
    assert len(buffers_of(running)) > len(running.compiled.buffers) + (0 if limit > 8 else 6)


@pytest.mark.parametrize(("layout", "limit"), LIMITS[1:3] + others(LIMITS[0], *LIMITS[3:]))
def test_in_parts_the_same_is_seen_first(
    device: Device, whole_depth: tuple[Renderer, bytes], monkeypatch: pytest.MonkeyPatch, layout: LayoutName, limit: int
) -> None:
    """As above, for the depth integrator, whose programs are small."""
    running = assert_same_in_parts(device, whole_depth, monkeypatch, layout, limit)
    assert len(buffers_of(running)) > len(running.compiled.buffers)


def buffers_of(running: Renderer) -> list[cl.Buffer]:
    return [each for each in running.session.scene_arguments if isinstance(each, cl.Buffer)]


def assert_same_in_parts(
    device: Device, whole: tuple[Renderer, bytes], monkeypatch: pytest.MonkeyPatch, layout: LayoutName, limit: int
) -> Renderer:
    """Return the renderer whose largest buffer has `limit` KiB, after checking that its image is that of `whole`."""
    assert isinstance(whole[0].session, SingleDeviceAccumulation) and whole[0].compiled.part_bytes is None
    monkeypatch.setenv(VARIABLE, f"{limit}K")
    running, found = film(device, layout, whole[0].scene.render.integrator)
    assert isinstance(running.session, MultiDeviceAccumulation) and found == whole[1]
    assert max(buffer.size for buffer in buffers_of(running)) <= limit << 10
    return running


def test_only_the_film_is_too_large(
    device: Device, whole: tuple[Renderer, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The program is the one for large buffers, except for the location of the film's pixels."""
    monkeypatch.setenv(VARIABLE, "80K")
    running, found = film(device, "bvh8")
    assert isinstance(running.session, MultiDeviceAccumulation) and found == whole[1]
    assert running.compiled.part_bytes is None and running.compiled.source == whole[0].compiled.source


@pytest.mark.combinations
def test_other_kernels_see_the_parts(
    device: Device, whole: tuple[Renderer, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = render_guides(whole[0].session, 2)
    monkeypatch.setenv(VARIABLE, "8K")
    found = render_guides(film(device, "bvh8")[0].session, 2)
    assert all(found[name].tobytes() == expected[name].tobytes() for name in expected)


@pytest.mark.parametrize(
    ("limit", "words"),
    [("4K", [f"{VARIABLE} to 5440", "4096"]), ("5440", ["at most 5.312 KiB", "MiB needs more", VARIABLE])],
)
def test_too_small_is_told_with_numbers(
    device: Device, monkeypatch: pytest.MonkeyPatch, limit: str, words: list[str]
) -> None:
    """A pack of triangles takes 320 bytes, and 17 must fit."""
    monkeypatch.setenv(VARIABLE, limit)
    vertices, faces = icosphere(4)
    with pytest.raises(NoRoomError) as raised:
        Renderer(Scene(meshes=[Mesh(vertices, faces, Diffuse())]), device=device.info.index, layout="bvh8")
    assert all(word in str(raised.value) for word in words), raised.value


@pytest.mark.parametrize("size", [1, 16, 100, 112, 113, 500])
def test_parts_hold_all_and_end_with_the_next(size: int) -> None:
    """Parts of 2 KiB hold 112 16-byte records of their own, followed by the first records of the next part."""
    values = np.arange(4 * size, dtype=np.int32).view([("x", "i4", 4)])
    found, own = list(parts(values, 2048)), part_records(16, 2048)
    assert own == 112 and len(found) == part_count(values, 2048) and max(part.nbytes for part in found) <= 2048
    for i in range(size):
        assert found[i // own][i % own] == values[i]
        run = values[i : i + OVERLAP + 1]
        assert np.array_equal(found[i // own][i % own : i % own + len(run)], run)


@pytest.mark.parametrize(("text", "expected"), [("", 1 << 40), ("65536", 1 << 16), ("1M", 1 << 20), ("9999G", 1 << 40)])
def test_the_variable(monkeypatch: pytest.MonkeyPatch, text: str, expected: int) -> None:
    monkeypatch.setenv(VARIABLE, text)
    assert largest_buffer(1 << 40) == expected


@pytest.mark.parametrize("text", ["0", "1T", "much", "-1", "1.5M"])
def test_what_the_variable_cannot_be(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    monkeypatch.setenv(VARIABLE, text)
    with pytest.raises(UsageError, match=VARIABLE):
        largest_buffer(1 << 40)


def test_where_there_is_no_room_windows_are_halved(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """The driver cannot allocate more than 100 KiB, although it reported a larger limit."""
    make = cl.Buffer

    def stingy(context: cl.Context, flags: int, size: int = 0, hostbuf: Any = None) -> cl.Buffer:
        if max(size, getattr(hostbuf, "nbytes", 0)) > 100_000:
            raise cl.MemoryError("clCreateBuffer", -4, "none left")
        return make(context, flags, size, hostbuf)

    monkeypatch.setattr(cl, "Buffer", stingy)
    monkeypatch.setattr("clrt.rendering.accumulation.device_worker.FEWEST_TILES", 4)
    running = Renderer(scene(), device=device.info.index, layout="bvh8", spp=4, size=(90, 66))
    state = list(running.passes(spp=4))[-1]
    assert isinstance(running.session, MultiDeviceAccumulation) and running.session.workers[0].window_tiles == 13
    monkeypatch.undo()
    again = Renderer(scene(), device=device.info.index, layout="bvh8", spp=4, size=(90, 66))
    assert state.film.pixels.tobytes() == list(again.passes(spp=4))[-1].film.pixels.tobytes()
