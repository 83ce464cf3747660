"""Path tracing by queues: the film equals that of the megakernel to the last bit."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.device.open import Device
from clrt.errors import UsageError
from clrt.rendering.accumulation import path_queues
from clrt.rendering.compile.choices import Choices
from clrt.rendering.film.film import Film
from clrt.rendering.renderer import Renderer

from ..covering import others
from .pictures import session
from .test_variants import everything, painted, planted, plastic_ball, sights
from .test_wavefront import assert_same, catching, followed as followed_by, transparent

SCENES = Path(__file__).parents[2] / "scenes"
#: Between them: every stage, hits sorted or not, instances, textures, opacity, absorption, a light tree.
GALLERY = "glass", "instances", "materials", "night", "textures"
PAINTED = painted(everything())
#: Clamping, many depths, an image without primitives, and one of a single pixel.
CASES = {
    "painted": PAINTED,
    "planted": planted(PAINTED),
    "lens": dict(sights(everything()))["lens"],
    "clamped": replace(PAINTED, render=replace(PAINTED.render, clamp_direct=1.0, clamp_indirect=0.5)),
    "too bright": replace(PAINTED, environment=replace(PAINTED.environment, strength=1e38)),
    "one edge": replace(PAINTED, render=replace(PAINTED.render, max_depth=1)),
    "deep": replace(plastic_ball(), render=replace(plastic_ball().render, max_depth=40)),
    "a pixel": replace(PAINTED, render=replace(PAINTED.render, size=(1, 1))),
    "sky": replace(everything(), meshes=[], spheres=[]),
    "transparent": transparent(PAINTED),
    "catching": catching(PAINTED),
}


followed = partial(followed_by, lanes=1)


def assert_equal(device: Device, queues: Film, lanes: Film) -> None:
    """Films are bit-identical where the compiler contracts no products (PoCL), and agree to rounding elsewhere."""
    assert queues.rays == lanes.rays
    if not device.is_pocl:
        return assert_same(queues, lanes)
    for name in lanes.pixels.dtype.names or ():
        np.testing.assert_array_equal(queues.pixels[name], lanes.pixels[name], err_msg=name)


@pytest.mark.programs
@pytest.mark.parametrize("name", [*others(*CASES), "painted"])
def test_queues_are_the_same_paths(device: Device, name: str) -> None:
    direct = name in ("painted", "clamped")
    lanes, queues = (followed(device, paths, CASES[name], direct_light=direct) for paths in ("lanes", "queues"))
    assert lanes.mean.mean() > (0.05 if lanes.alpha is not None else 0.1)
    assert (lanes.nonfinite_samples > 0) == (name == "too bright")
    assert name != "catching" or lanes.pixels["catcher"].max() > 0
    assert_equal(device, queues, lanes)


@pytest.mark.programs
@pytest.mark.parametrize("name", GALLERY)
def test_gallery_by_queues(device: Device, name: str) -> None:
    scene = clrt.load(SCENES / f"{name}.toml")
    scene = replace(scene, render=replace(scene.render, size=(40, 30)))
    lanes, queues = (followed(device, paths, scene, 3) for paths in ("lanes", "queues"))
    assert lanes.rays > 40 * 30 * 3
    assert_equal(device, queues, lanes)


def test_sums_do_not_depend_on_the_cut(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Samples are added per pixel in their order: any passes, and queues of any capacity, give the same bits."""
    whole, parts = (followed(device, "queues", PAINTED, *cut).pixels for cut in ((9,), (1, 2, 6)))
    monkeypatch.setattr(path_queues, "MOST_SLOTS", path_queues.FEWEST_SLOTS)
    short = followed(device, "queues", PAINTED, 9)
    for other in (parts, short.pixels):
        np.testing.assert_array_equal(whole, other)


def test_a_launch_fits_the_queues(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """Launches have at most as many samples as the queues have slots, and the queues are part of the memory."""
    monkeypatch.setattr(path_queues, "MOST_SLOTS", 1 << 11)
    running = session(device, PAINTED, lanes=1, paths="queues")
    before = running.device_bytes
    for _ in running.render(64):
        assert int(running.launch["pixel_count"][0]) * int(running.launch["sample_count"][0]) <= 1 << 11
    assert running.scene.most_work == 1 << 11
    slot = sum(path_queues.slot_bytes(running.compiled).values())
    assert running.device_bytes - before >= (1 << 11) * slot // 2 and running.device_bytes > (1 << 11) * slot


@pytest.mark.combinations
def test_several_devices_and_resumption(device: Device, tmp_path: Path) -> None:
    """Two workers, and a render resumed from a checkpoint, give the film of one."""
    options: dict[str, Any] = {"paths": "queues", "spp": 8, "size": (64, 48)}
    whole = Renderer(PAINTED, device=device.info.index, **options)
    pair = Renderer(PAINTED, device=[device.info.index] * 2, **options)
    for renderer in (whole, pair):
        for _ in renderer.passes():
            pass
    for stop_after in (2, 8):
        resumed = Renderer(PAINTED, device=device.info.index, checkpoint=tmp_path / "film", resume=True, **options)
        for state in resumed.passes():
            if state.spp >= stop_after:
                break
        assert (state.spp < 8) == (stop_after < 8)
    one, two, three = (renderer.session.film().pixels for renderer in (whole, pair, resumed))
    np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(one, three)


def test_queues_need_one_lane(device: Device) -> None:
    with pytest.raises(UsageError, match="queues needs 1 lane, not 8"):
        Renderer(everything(), device=device.info.index, lanes=8, paths="queues")
    assert Choices(paths="queues").on(device).lanes == 1
    assert Choices(lanes=1).on(device).paths == ("queues" if device.info.type == "gpu" else "lanes")
