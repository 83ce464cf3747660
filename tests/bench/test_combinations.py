"""Random scenes with all features, and the identities that their images obey."""

from __future__ import annotations

import os
from dataclasses import fields, replace
from datetime import date
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.bench.combinations.combinations import ROUNDS, keep_scenes, verdict, verdicts
from clrt.bench.combinations.identities import PROPERTIES, Side, single_lights, strategies
from clrt.bench.combinations.random_draws import Draws
from clrt.bench.combinations.random_scenes import BATCH, random_scene
from clrt.bench.kernel_probe import choices
from clrt.device.open import Device
from clrt.rendering.accumulation.launch_plan import LaunchPlan
from clrt.rendering.accumulation.single_device import SingleDeviceAccumulation
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.lights import LIGHTS, PointLight
from clrt.scene.materials.material_types import MATERIALS, Diffuse, Material
from clrt.scene.materials.textures import Texture
from clrt.scene.model import Camera, Environment, Mesh, RenderSettings, Scene, Sphere
from clrt.scene.validation.validate import scene_problems

#: Environment variable of the seed; the default is the date, so that the scenes change every day.
VARIABLE = "CLRT_COMBINATIONS_SEED"
TODAY = int(os.environ.get(VARIABLE, date.today().toordinal()))
#: Scenes of the test suite, from one batch, which shares programs.
SCENES = range(2)


def materials(scene: Scene) -> list[Material]:
    users: list[Mesh | Sphere] = [*scene.meshes, *scene.spheres, *(each.mesh for each in scene.instances)]
    return [user.material for user in users]


@pytest.mark.parametrize("name", PROPERTIES)
def test_pictures_of_random_scenes_obey(device: Device, name: str) -> None:
    """`clrt bench combinations` tests hundreds of scenes."""
    print(f"seed {TODAY}")
    again = f"`clrt bench combinations --seed {TODAY} --scenes {len(SCENES)} --property {name}` or {VARIABLE}={TODAY}"
    for each in verdicts(device, [name], TODAY, SCENES):
        assert not each.is_off(len(SCENES) * len(PROPERTIES)), f"{again} tests this again: {each}"
        assert each.dropped == 0, f"{again} drops samples again: {each}"


def three_lights() -> Scene:
    """Return a sphere on a floor under an emissive sphere, a point light and a constant environment."""
    lamp = Diffuse(emission=(9.0, 9.0, 9.0))
    return Scene(
        spheres=[
            Sphere(),
            Sphere(center=(0.0, -100.0, 0.0), radius=99.0),
            Sphere(center=(2.0, 3.0, 0.0), radius=0.5, material=lamp),
        ],
        lights=[PointLight(position=(-2.0, 3.0, 0.0), intensity=(9.0, 9.0, 9.0))],
        environment=Environment(color=(0.5, 0.5, 0.5)),
        camera=Camera(position=(0.0, 1.0, 5.0)),
        render=RenderSettings(size=(24, 16), max_depth=3),
    )


def pixels(device: Device, side: Side) -> NDArray[np.float64]:
    """Return the image of a side's first scene with few samples, with the same random numbers for all sides."""
    scene = side.scenes[0]
    compiled = compile_scene(scene, choices(device))
    compiled = replace(compiled, chosen_files={**compiled.chosen_files, **side.files})
    session = SingleDeviceAccumulation(device, compiled, LaunchPlan(scene.render.size, scene.render.max_depth, 1, 4))
    for _ in session.render(4):
        pass
    return session.film().mean


@pytest.mark.parametrize("share, off", [(1.0, False), (0.99, True)])
def test_a_difference_of_one_percent_is_found(device: Device, share: float, off: bool) -> None:
    scene = three_lights()
    other = Side("other", [replace(scene, render=replace(scene.render, sampler="independent"))], scale=share)
    found = verdict(device, "additivity", 0, [Side("scene", [scene]), other])
    assert found.is_off() == off and abs(found.mean - share) < 5 * found.noise
    assert found.noise < 0.005 and (found.rounds == len(ROUNDS)) == off


def test_a_lost_light_is_found(device: Device) -> None:
    scene = three_lights()
    parts = list(single_lights(scene))
    assert len(parts) == 3
    assert verdict(device, "additivity", 0, [Side("all", [scene]), Side("two", parts[1:])]).is_off()


def test_a_light_too_small_for_bsdf_sampling_is_not_off(device: Device) -> None:
    """BSDF sampling finds that light in no sample, so the deviations over seeds say nothing."""
    scene = three_lights()
    small = replace(scene.spheres[-1], center=(200.0, 300.0, 0.0), radius=0.1)
    dark = replace(scene, spheres=[*scene.spheres[:-1], small], lights=[], environment=Environment())
    both, bsdf, _ = strategies(dark, Draws(0, 0, 0))
    assert not verdict(device, "strategies", 0, [both, bsdf]).is_off()
    found, missed = (pixels(device, each) for each in (both, bsdf))
    assert found.mean() > 0 and not missed.any()


@pytest.mark.parametrize("name", ["strategies", "choice"])
def test_other_strategies_draw_other_noise(device: Device, name: str) -> None:
    """Different noise shows that the kernel files were replaced."""
    first, *others = PROPERTIES[name](three_lights(), Draws(0, 0, 0))
    assert all(np.any(pixels(device, first) != pixels(device, other)) for other in others)


def test_scenes_have_everything() -> None:
    """Valid scenes cover every field of every material and light off its default and, if allowed, as a texture; also
    normal maps on clearcoats, and roughness textures of layered materials."""
    varied, textured, features = set[tuple[Any, str]](), set[tuple[Any, str]](), set[str]()
    for batch in range(300):
        scene = random_scene(3, batch * BATCH)
        assert not scene_problems(scene)
        users: list[Any] = [*materials(scene), *scene.lights]
        values = [(type(each), field, getattr(each, field.name)) for each in users for field in fields(each)]
        varied |= {(kind, field.name) for kind, field, value in values if value != field.default}
        textured |= {(kind, field.name) for kind, field, value in values if isinstance(value, Texture)}
        features = features.union(*(each.features() for each in materials(scene)))
    # Identities of light do not hold for what is left out of an image; layers of light groups have their own tests.
    composited = {"catcher", "camera_visible", "light_group"}
    every = {
        (kind, field.name): get_type_hints(kind)[field.name]
        for kind in (*MATERIALS, *LIGHTS)
        for field in fields(kind)
        if field.name not in composited
    }
    assert every.keys() <= varied
    assert {field for field, hint in every.items() if Texture in get_args(hint)} <= textured
    assert {"COAT_NORMALS", "LAYER_ROWS"} <= features


def test_scenes_have_instances(device: Device) -> None:
    """Instances stay instances instead of becoming meshes."""
    scene = next(scene for batch in range(99) if (scene := random_scene(3, batch * BATCH)).instances)
    assert "INSTANCES" in compile_scene(scene, choices(device), device=device).features


def test_scenes_of_a_batch_share_programs(device: Device) -> None:
    for batch in range(4):
        scenes = [random_scene(5, batch * BATCH + number) for number in range(3)]
        assert len({compile_scene(scene, choices(device), device=device).source for scene in scenes}) == 1
        assert len({scene.camera.position for scene in scenes}) == len(scenes)


def test_single_lights_share_out_all_lights() -> None:
    """Each light, environment and emissive material is in exactly one of the scenes."""
    for number in range(0, 20 * BATCH, BATCH):
        scene = random_scene(4, number)
        parts = list(single_lights(scene))
        count = len(scene.lights) + len({id(each) for each in materials(scene) if any(each.radiance)})
        sky = scene.environment.image is not None or any(scene.environment.color)
        assert len(parts) == count + sky
        for part in parts:
            lit = [each for each in materials(part) if any(each.radiance)]
            own_sky = part.environment.image is not None or any(part.environment.color)
            assert len(part.lights) + len({id(each) for each in lit}) + own_sky == 1


def test_scenes_that_are_off_are_kept(device: Device, tmp_path: Path) -> None:
    """The stored files render the same image."""
    seed = next(seed for seed in range(99) if not random_scene(seed, 0).instances)
    found = next(verdicts(device, ["brightness"], seed, [0]))
    kept = keep_scenes(found, seed, tmp_path)
    assert len(kept) == 2
    loaded, scene = clrt.load(kept[0]), random_scene(seed, 0)
    same = [pixels(device, Side("", [each])) for each in (loaded, scene)]
    np.testing.assert_allclose(same[0], same[1], rtol=1e-4, atol=1e-5)
