"""Progressive rendering: stop conditions, intermediate states, and the report."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clrt.device.open import Device
from clrt.errors import UsageError
from clrt.rendering.film.state import State
from clrt.rendering.render_report import render_report
from clrt.rendering.renderer import Renderer
from clrt.scene.lights import PointLight
from clrt.scene.model import Camera, Environment, RenderSettings, Scene, Sphere

#: Fields that other programs read; the command line adds total_seconds.
REPORT = {
    "scene",
    "device",
    "platform",
    "driver",
    "version",
    "width",
    "height",
    "spp",
    "max_depth",
    "seed",
    "seconds",
    "samples",
    "samples_per_second",
    "rays",
    "rays_per_second",
    "stop_reason",
    "noise",
    "nonfinite_samples",
    "bvh",
    "kernel",
    "peak_device_bytes",
    "history",
}
BVH = {"triangles", "spheres", "instances", "nodes", "bytes", "build_seconds", "sah_cost", "layout"}
KERNEL = {"build_seconds", "cached", "features"}


@pytest.fixture
def renderer(device: Device) -> Renderer:
    """Return a renderer of a point light above a sphere under a sky: noisy and fast."""
    scene = Scene(
        spheres=[Sphere(), Sphere(center=(0.0, -101.0, 0.0), radius=100.0)],
        name="ball",
        lights=[PointLight(position=(2.0, 3.0, 2.0), intensity=(20.0, 20.0, 20.0))],
        environment=Environment(color=(0.5, 0.5, 0.5)),
        camera=Camera(position=(0.0, 1.0, 6.0)),
        render=RenderSettings(size=(40, 30), spp=12, max_depth=4, seed=6),
    )
    return Renderer(scene, device=device.info.index)


def test_stops_at_spp(renderer: Renderer) -> None:
    """It uses the scene's spp by default; the history has the powers of two and the end."""
    states = list(renderer.passes())
    assert renderer.stop_reason == "spp" and states[-1].spp == 12
    assert np.all(states[-1].film.pixels["count"] == 12)
    spps = [entry["spp"] for entry in renderer.history]
    assert spps == [state.spp for state in states] and {1, 2, 4, 8, 12} <= set(spps)
    seconds = [entry["seconds"] for entry in renderer.history]
    assert seconds == sorted(seconds) and seconds[0] > 0
    assert renderer.history[0]["noise"] is None
    noises = [entry["noise"] for entry in renderer.history[1:]]
    assert all(noise > 0 for noise in noises)


def test_goes_on_where_it_stopped(renderer: Renderer, device: Device) -> None:
    """5 samples and then up to 12 give the same image as 12 at once, bit for bit."""
    first = list(renderer.passes(spp=5))[-1]
    assert first.spp == 5
    last = list(renderer.passes(spp=12))[-1]
    assert last.spp == 12 and renderer.history[-1]["seconds"] > first.seconds
    at_once = list(Renderer(renderer.scene, device=device.info.index).passes(spp=12))[-1]
    assert last.film.pixels.tobytes() == at_once.film.pixels.tobytes()


def test_stops_after_a_time(renderer: Renderer) -> None:
    last = list(renderer.passes(time=0.2))[-1]
    assert renderer.stop_reason == "time" and last.seconds >= 0.2
    assert last.spp >= 1 and np.all(last.film.pixels["count"] >= last.spp)


def test_stops_at_an_error(renderer: Renderer) -> None:
    """It stops at the first state whose estimated error is low enough."""
    states = list(renderer.passes(error=0.02))
    assert renderer.stop_reason == "error"
    *before, last = [state.noise for state in states]
    assert last is not None and last <= 0.02
    assert all(noise is None or noise > 0.02 for noise in before)


@pytest.mark.parametrize(
    ("stops", "reason"),
    [
        ({"spp": 4, "time": 1000.0, "error": 1e-9}, "spp"),
        ({"spp": 1 << 20, "time": 1000.0, "error": 0.05}, "error"),
        ({"spp": 1 << 30, "time": 0.1, "error": 1e-9}, "time"),
    ],
)
def test_the_first_condition_met_ends_it(renderer: Renderer, stops: dict[str, float], reason: str) -> None:
    for _ in renderer.passes(**stops):  # type: ignore[arg-type]
        pass
    assert renderer.stop_reason == reason


@pytest.mark.parametrize(
    "stops",
    [
        {"spp": 0},
        {"time": -1.0},
        {"error": float("nan")},
        {"time": float("inf")},
        {"spp": "4"},
        {"spp": 1.5},
        {"spp": True},
        {"time": "1"},
        {"error": [0.1]},
    ],
    ids=str,
)
def test_impossible_conditions_are_refused(renderer: Renderer, stops: dict[str, Any]) -> None:
    with pytest.raises(UsageError, match=next(iter(stops))):
        next(renderer.passes(**stops))


@pytest.mark.parametrize(
    "reference, said",
    [
        (np.zeros((4, 4, 3)), "of shape \\(4, 4, 3\\); give a numpy array of the image's shape, \\(30, 40, 3\\)"),
        ("full.exr", "read it with clrt.read_image"),
        (np.full((30, 40, 3), "1"), "give real numbers"),
        (np.where(np.arange(3600).reshape(30, 40, 3) < 5, [np.nan, np.inf, 1], 1), "NaN or infinite \\(2 of 1200\\)"),
    ],
)
def test_what_is_no_reference_is_refused(renderer: Renderer, reference: Any, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        next(renderer.passes(spp=1, reference=reference))


def test_what_was_planned_is_where_it_ends(renderer: Renderer, device: Device) -> None:
    planned = Renderer(renderer.scene, device=device.info.index, spp=np.int64(6))  # type: ignore[arg-type]
    assert list(planned.passes())[-1].spp == 6


def test_launches_run_while_a_state_is_made(renderer: Renderer) -> None:
    """Except after the last one, and if an error is a stop condition."""

    def ahead(state: State) -> bool:
        return bool(renderer.session.work.parts) or renderer.session.samples_done > state.spp

    *states, last = [ahead(state) for state in renderer.passes()]
    assert states and all(states) and not last
    assert not any(ahead(state) for state in renderer.passes(spp=20, error=1e-9))


@pytest.mark.parametrize("left_at", [1, 4, 8])
def test_left_at_a_state_it_goes_on(renderer: Renderer, device: Device, left_at: int) -> None:
    """The image is the same, and each state is in the history once."""
    for state in renderer.passes():
        if state.spp == left_at:
            break
    *_, last = renderer.passes()
    *_, at_once = Renderer(renderer.scene, device=device.info.index).passes()
    assert last.film.pixels.tobytes() == at_once.film.pixels.tobytes() and last.noise == at_once.noise
    assert [entry["spp"] for entry in renderer.history if entry["spp"] in (1, 2, 4, 8, 12)] == [1, 2, 4, 8, 12]


@pytest.mark.parametrize("other, rest", [(2, [8, 12]), (8, [12]), (40, [])])
def test_two_that_take_turns(renderer: Renderer, other: int, rest: list[int]) -> None:
    """Each continues from the current film, which may be ahead of its last state, to its own end."""
    first = renderer.passes(spp=12)
    while next(first).spp < 2:
        pass
    list(renderer.passes(spp=other))
    assert [state.spp for state in first if state.spp & (state.spp - 1) == 0 or state.spp == 12] == rest


@pytest.mark.parametrize(
    "chosen",
    [
        {"layout": "octree"},
        {"lanes": 3},
        {"triangle": "square"},
        {"builder": "hope"},
        {"spp": "4"},
        {"spp": 1.5},
        {"tree": "off"},
    ],
    ids=str,
)
def test_unknown_choices_are_refused(device: Device, chosen: dict[str, object]) -> None:
    with pytest.raises(UsageError, match=next(iter(chosen))):
        Renderer(Scene(), device=device.info.index, **chosen)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        ("scenes/cornell.toml", '"scenes/cornell.toml" is not of type Scene; write a clrt.Scene, or clrt.load'),
        (Path("a.glb"), "a.glb.* is not of type Scene; write a clrt.Scene, or clrt.load"),
        (Camera(), "Camera.* is not of type Scene; write a clrt.Scene"),
    ],
    ids=str,
)
def test_what_is_no_scene_is_refused(scene: Any, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        Renderer(scene)


def test_no_device_at_all_is_refused() -> None:
    with pytest.raises(UsageError, match="give at least one"):
        Renderer(Scene(), device=[])


def test_relmse_against_a_reference(renderer: Renderer) -> None:
    """mean((x − r)²/(r² + 0.01)), in the state and in the history."""
    reference = np.random.default_rng(0).random((30, 40, 3)).astype(np.float32)
    last = list(renderer.passes(spp=4, reference=reference))[-1]
    expected = np.mean((last.pixels.astype(float) - reference) ** 2 / (reference.astype(float) ** 2 + 0.01))
    assert last.relmse == pytest.approx(expected, rel=1e-6)
    assert renderer.history[-1]["relmse"] == last.relmse


def test_report(renderer: Renderer) -> None:
    """Every field is present, numbers are consistent, and the JSON has no NaN."""
    last = list(renderer.passes(spp=8, reference=np.ones((30, 40, 3), np.float32)))[-1]
    report = json.loads(json.dumps(render_report(renderer, last), allow_nan=False))
    assert REPORT <= set(report) and BVH <= set(report["bvh"]) and KERNEL <= set(report["kernel"])
    assert all({"spp", "seconds", "noise", "relmse"} <= set(entry) for entry in report["history"])
    assert (report["scene"], report["width"], report["height"], report["spp"]) == ("ball", 40, 30, 8)
    assert (report["max_depth"], report["seed"], report["stop_reason"], report["nonfinite_samples"]) == (4, 6, "spp", 0)
    assert report["samples"] == 40 * 30 * 8 and report["rays"] > report["samples"]
    assert report["samples_per_second"] == pytest.approx(report["samples"] / report["seconds"])
    assert report["rays_per_second"] == pytest.approx(report["rays"] / report["seconds"])
    assert report["noise"] == report["history"][-1]["noise"] == last.noise
    assert (report["bvh"]["triangles"], report["bvh"]["spheres"]) == (0, 2)
    assert report["peak_device_bytes"] > 40 * 30 * 12
    assert isinstance(report["kernel"]["cached"], bool) and "SPHERES" in report["kernel"]["features"]


def test_direct_is_two_edges(renderer: Renderer, device: Device) -> None:
    """The integrator "direct" is the path tracer of depth 2."""
    direct, shallow = (
        list(Renderer(renderer.scene, device=device.info.index, **given).passes(spp=4))[-1].pixels
        for given in ({"integrator": "direct"}, {"max_depth": 2})
    )
    assert np.array_equal(direct, shallow)
