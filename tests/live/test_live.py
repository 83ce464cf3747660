"""A live session shows the same image as a render after any edits, and rebuilds no more than necessary."""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pyopencl as cl
import pytest

import clrt
from clrt.device import contexts
from clrt.device.open import Device
from clrt.live.history import History
from clrt.live.image_sizing import DIVISORS, ImageSizing
from clrt.live.live import Live
from clrt.live.picks import PickRequests, Thing
from clrt.live.settings import Settings
from clrt.live.snapshot import Snapshot
from clrt.scene.editing import with_material
from clrt.scene.geometry.instancing import FEW_TRIANGLES
from clrt.scene.lights import PointLight
from clrt.scene.materials.material_types import Diffuse, Mirror
from clrt.scene.model import Camera, Environment, Instance, Mesh, RenderSettings, Scene, Sphere

from ..rendering.pictures import quad
from ..rendering.rays import icosphere

SPP = 5
SECONDS = 250.0


def room() -> Scene:
    """Return a scene with spheres, a mesh large enough for a BVH, a floor, emitters, and an environment map."""
    vertices, faces = icosphere(2)
    floor = quad([(-4, -1, 4), (4, -1, 4), (4, -1, -4), (-4, -1, -4)], Diffuse(color=(0.7, 0.6, 0.5)))
    sky = np.random.default_rng(0).random((4, 8, 3), np.float32)
    return Scene(
        meshes=[floor, Mesh(vertices * np.float32(0.7), faces, Diffuse(color=(0.2, 0.5, 0.8)))],
        spheres=[
            Sphere(center=(1.2, 0, 0), radius=0.4, material=Mirror()),
            Sphere(center=(0, 2, 0), radius=0.2, material=Diffuse(emission=(9.0, 9.0, 9.0))),
        ],
        lights=[PointLight(position=(2.0, 2.0, 2.0), intensity=(5.0, 5.0, 5.0))],
        environment=Environment(image=sky),
        camera=Camera(position=(0.0, 1.0, 5.0)),
        render=RenderSettings(size=(40, 30), spp=SPP, max_depth=4),
    )


@pytest.fixture
def live(device: Device) -> Iterator[Live]:
    contexts.share_no_more()  # a context worn out by other tests would be replaced midway
    with Live(room(), device=device.info.index) as live:
        yield live


def whole(live: Live) -> Snapshot:
    """Return the snapshot of the last request, with all its samples."""
    seen = live.wait(lambda now: now.asked == live.asked and (now.error is not None or is_whole(now)), SECONDS)
    assert seen.asked == live.asked
    return seen


def is_whole(seen: Snapshot) -> bool:
    return seen.phase == "rest" and seen.pixels.shape[1::-1] == seen.size and seen.spp == seen.scene.render.spp


def check_as_rendered(live: Live, device: Device) -> Snapshot:
    """Assert that the snapshot equals a render of the same scene bit for bit, and return it."""
    seen = whole(live)
    expected = clrt.render(live.scene, device=device.info.index, spp=SPP, **live.settings.tracing)
    assert seen.error is None and np.array_equal(seen.pixels, expected.pixels)
    image = live.image()
    assert np.array_equal(image.pixels, expected.pixels)
    assert image.report["spp"] == SPP and image.report["scene_hash"] == expected.report["scene_hash"]
    return seen


def moved(scene: Scene) -> Scene:
    x, y, z = scene.camera.position
    return replace(scene, camera=replace(scene.camera, position=(x + 0.1, y, z)))


def values(scene: Scene) -> Iterator[tuple[str, Scene]]:
    """Yield edits that change values only, not the scene's structure."""
    blue = Diffuse(color=(0.1, 0.2, 0.9))
    lamp = PointLight(position=(-1.0, 2.0, 2.0), intensity=(1.0, 5.0, 5.0))
    yield "camera", moved(scene)
    yield "material", with_material(scene, scene.meshes[1].material, blue)
    yield "sphere", replace(scene, spheres=[replace(scene.spheres[0], center=(1.0, 0.3, 0.5)), scene.spheres[1]])
    yield "light", replace(scene, lights=[lamp])
    yield "sky", replace(scene, environment=replace(scene.environment, rotation_degrees=45.0))
    yield "depth", replace(scene, render=replace(scene.render, max_depth=2, seed=3))


@pytest.mark.programs
def test_edits_of_values_build_nothing_and_show_what_a_render_shows(live: Live, device: Device) -> None:
    """Neither program nor BVH is rebuilt; edits follow each other, so each starts from the state left by the last."""
    first = check_as_rendered(live, device)
    for name, _ in values(live.scene):
        live.edit(dict(values(live.scene))[name])
        seen = check_as_rendered(live, device)
        assert (seen.programs, seen.tree) == (first.programs, first.tree), name
    live.edit(with_material(live.scene, live.scene.spheres[0].material, clrt.Dielectric()))
    assert check_as_rendered(live, device).programs == first.programs + 1
    large = replace(live.scene.meshes[1], vertices=live.scene.meshes[1].vertices * np.float32(1.2))
    live.edit(replace(live.scene, meshes=[live.scene.meshes[0], large]))
    seen = check_as_rendered(live, device)
    assert seen.programs == first.programs + 1 and seen.tree["build_seconds"] != first.tree["build_seconds"]
    live.choose(replace(live.settings, tree=False))
    assert check_as_rendered(live, device).tree["nodes"] == 0


@pytest.mark.programs
def test_what_is_seen_at_a_place(live: Live) -> None:
    """Works during a render and at rest; removed objects are not picked, and after an error the last image counts."""
    ball, mesh = live.scene.spheres[0], live.scene.meshes[1]
    places = {(0.5, 0.5): mesh, (0.74, 0.5): ball, (0.5, 0.97): live.scene.meshes[0], (0.02, 0.02): None}
    for _ in range(2):
        for place, thing in places.items():
            assert live.pick(*place).result(SECONDS) is thing, place
        whole(live)
    live.edit(replace(live.scene, spheres=live.scene.spheres[1:]))
    whole(live)
    assert live.pick(0.74, 0.5).result(SECONDS) is not ball
    broken = replace(live.scene)
    broken.lights = [3]  # type: ignore[list-item]
    live.edit(broken)
    assert whole(live).error is not None and live.pick(0.5, 0.5).result(SECONDS) is mesh


@pytest.mark.programs
def test_moved_instances_keep_the_trees_of_their_meshes(device: Device) -> None:
    """Only the upper level is rebuilt; the image equals that of a new render."""
    vertices, faces = icosphere(6)
    assert len(faces) > FEW_TRIANGLES
    ball = Mesh(vertices, faces, Diffuse())

    def placed(x: float) -> list[Instance]:
        return [Instance(ball, np.column_stack([np.eye(3), (side * x, 0, 0)])) for side in (-1, 1)]

    scene = replace(room(), meshes=room().meshes[:1], instances=placed(1.2))
    with Live(scene, device=device.info.index) as live:
        first = check_as_rendered(live, device)
        live.edit(replace(scene, instances=placed(2.0)))
        seen = check_as_rendered(live, device)
        assert first.tree["instances"] == seen.tree["instances"] == 2 and seen.programs == first.programs


def test_movements_are_shown_in_time_and_then_whole(live: Live, device: Device) -> None:
    """Images are reduced while the camera moves, as large as time allows, and have full size at rest."""
    whole(live)
    live.choose(replace(live.settings, frame_rate=1000.0))
    whole(live)
    live.edit(moved(live.scene), moving=True, step=False)
    seen = live.wait(lambda now: now.asked == live.asked and now.spp > 0 and now.scene is live.scene, SECONDS)
    assert seen.pixels.shape[1] < seen.size[0]
    check_as_rendered(live, device)


def test_mistakes_are_told_and_the_last_picture_stays(live: Live, device: Device) -> None:
    good = whole(live)
    wrong = replace(live.scene)
    wrong.environment = 3  # type: ignore[assignment]
    live.edit(wrong)
    seen = whole(live)
    assert seen.error and "environment: 3 is not of type" in seen.error and seen.pixels is good.pixels
    live.choose(replace(live.settings, device="no such device"))
    assert "no such device" in (whole(live).error or "")
    live.choose(replace(live.settings, device=device.info.index))
    live.undo()
    assert live.can_redo and not live.can_undo
    check_as_rendered(live, device)


def test_after_many_programs_the_device_is_opened_anew(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """The old context must be released completely first: PoCL's compiler is shared by all contexts."""
    contexts.share_no_more()  # the tests' own device is in use
    with Live(room(), device=device.info.index) as live:
        whole(live)
        before = weakref.ref(live._renderer._devices[0].shared)
        ended = list[bool]()

        def made(devices: list[cl.Device]) -> cl.Context:
            ended.append(before() is None)
            return cl.Context(devices)

        monkeypatch.setattr(contexts, "MOST_COMPILED", 0)
        monkeypatch.setattr(contexts, "Context", made)
        live.edit(moved(live.scene))
        check_as_rendered(live, device)
        assert ended and all(ended)


def test_the_newest_edit_wins(live: Live, device: Device) -> None:
    """A hundred edits at once are not rendered one by one."""
    number = whole(live).number
    for _ in range(100):
        live.edit(moved(live.scene))
    seen = check_as_rendered(live, device)
    assert seen.scene.camera.position[0] == pytest.approx(10.0) and seen.number < number + 100


def test_steps_are_undone_and_what_is_no_step_stays() -> None:
    history, scene = History(), room()
    first = scene

    def step(after: Scene, goes_on: bool = False) -> Scene:
        history.record(scene, after, goes_on)
        return after

    for x in (1.0, 2.0, 3.0):  # a dragged value
        scene = step(replace(scene, spheres=[replace(scene.spheres[0], radius=x)]), goes_on=x < 3)
    scene = step(replace(scene, lights=[]))
    scene = moved(scene)  # a camera movement
    before = history.undo(scene)
    assert before.lights is first.lights and before.spheres is scene.spheres and before.camera is scene.camera
    assert history.undo(before).spheres is first.spheres and not history.can_undo
    assert history.redo(replace(first, camera=scene.camera)).spheres is scene.spheres
    assert history.redo(first).lights == [] and not history.can_redo


def test_pace() -> None:
    """If a sample takes 1 µs per pixel and preparation 10 ms, the largest size in time is chosen, or the smallest."""
    pace, full = ImageSizing(), (1600, 900)
    for _ in range(20):
        pace.note(pace.size(full, 1, 0.1), 1, 0.01, 1e-6 * np.prod(pace.size(full, 1, 0.1)))
    width, height = pace.size(full, 1, 0.1)
    assert 0.01 + 1e-6 * width * height <= 0.1 < 0.01 + 1e-6 * width * height * 2**2
    assert pace.size(full, 1, 10.0) == full
    assert pace.size(full, 1000, 0.1)[0] == round(1600 / DIVISORS[-1])


@pytest.mark.parametrize("wrong", [{"scale": 0.0}, {"samples": 0}, {"frame_rate": -1.0}, {"scale": float("nan")}])
def test_settings_have_limits(wrong: dict[str, Any]) -> None:
    with pytest.raises(clrt.UsageError, match=f"{list(wrong)[0]} is .*; it must be"):
        Settings(**wrong)


def test_picks_that_nobody_waits_for() -> None:
    """A cancelled pick or an error of any type does not affect other picks; after the end, picks are cancelled."""
    picks = PickRequests()
    given_up, wrong, last = (picks.ask(x, 0.0) for x in (0.1, 0.2, 0.3))
    given_up.cancel()

    def seen_at(x: float, y: float) -> Thing | None:
        if x == 0.2:
            raise MemoryError("too much")
        return None

    picks.answer(seen_at)
    assert last.result(0) is None and isinstance(wrong.exception(0), MemoryError)
    live = Live(Scene())
    live.close()
    assert live.pick(0.5, 0.5).cancelled()
