"""Light groups: layers that add up to the image, each of which is the image in the lights of its group."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import date, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.bench.combinations.identities import brighter, in_groups, only_lit, with_materials
from clrt.bench.combinations.random_draws import Draws
from clrt.bench.combinations.random_scenes import random_scene
from clrt.device.device_info import Paths
from clrt.device.open import Device
from clrt.errors import CheckpointError, ObjectError, SceneError, UsageError
from clrt.rendering.accumulation.launch_plan import LaunchPlan
from clrt.rendering.accumulation.single_device import SingleDeviceAccumulation
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.rendering.film.film import Film
from clrt.rendering.film.group_layers import group_layers, shares
from clrt.scene.light_groups import DEFAULT, MOST_GROUPS, light_groups
from clrt.scene.lights import DirectionalLight, Light, PointLight
from clrt.scene.materials.material_types import Diffuse, Mirror
from clrt.scene.model import Backdrop, Environment, Scene, Sphere

from ..covering import others
from .pictures import quad
from .test_queues import assert_equal
from .test_variants import everything, painted
from .test_wavefront import assert_same, catching, followed, transparent

Doubles = NDArray[np.float64]
#: So much darker is light that is out: it changes no random decision, and no digit of what else is there.
OUT = 2.0**-70
TODAY = date.today().toordinal()


def grouped(seed: int = 0) -> Scene:
    """Return lights and emissive surfaces of all types in groups, with an environment and a sun in different ones."""
    scene = in_groups(painted(everything()), Draws(seed, 0, 0))
    sun = DirectionalLight(direction=(0.3, -1.0, -0.2), irradiance=(1, 1, 1), angle_degrees=40, light_group="sun")
    panel = quad(
        [(-2, 0.2, 0), (-2, 0.2, 1), (-2, 1.5, 1), (-2, 1.5, 0)], Diffuse(emission=(2, 3, 4), light_group="panel")
    )
    sign = clrt.Instance(panel, np.eye(3, 4) + np.eye(3, 4, 3), Diffuse(emission=(4, 2, 1), light_group="sign"))
    return replace(
        scene,
        meshes=[panel, *scene.meshes],
        instances=[sign],
        lights=[*scene.lights, sun],
        environment=replace(scene.environment, light_group="sky"),
    )


def lamp_and_mirror() -> Scene:
    """Return a lamp, seen directly, through a veil and in a mirror, and a sky, in groups of their own."""
    lamp = Sphere(
        center=(0, 2, 0), radius=0.5, material=Diffuse(color=(0, 0, 0), emission=(3, 2, 1), light_group="lamp")
    )
    veil = Sphere(center=(0, 1, 1.5), radius=0.3, material=Diffuse(color=(0, 0, 0), opacity=0.5))
    return Scene(
        spheres=[lamp, veil, Sphere(material=Mirror())],
        environment=Environment(color=(0, 1, 0), light_group="sky"),
        camera=clrt.Camera(position=(0, 1, 5)),
        render=clrt.RenderSettings(size=(24, 24), spp=4),
    )


def clamped(scene: Scene) -> Scene:
    return replace(scene, render=replace(scene.render, clamp_direct=1.0, clamp_indirect=0.5))


def before_backdrop(scene: Scene) -> Scene:
    return replace(scene, backdrop=Backdrop(color=(0.1, 0.2, 0.3)))


#: A film with clamps, with coverage, with catchers, and what a scene without lights or surfaces has.
SCENES = {
    "grouped": grouped(),
    "clamped": clamped(grouped()),
    "transparent": transparent(grouped()),
    "catching": catching(grouped()),
    "before a backdrop": before_backdrop(grouped()),
    "a catcher before a backdrop": before_backdrop(
        replace(catching(grouped()), render=replace(grouped().render, transparent=False))
    ),
    "sky": replace(grouped(), meshes=[], spheres=[], instances=[]),
    "without a sky": replace(grouped(), environment=Environment(), lights=grouped().lights[:-1]),
    "no lights": Scene(spheres=[Sphere()], render=everything().render),
    "too bright": replace(grouped(), environment=replace(grouped().environment, strength=1e38)),
}


#: Those that run without `-m combinations`: every feature that the film's other parts have with groups.
FEW = ("clamped", "a catcher before a backdrop", "without a sky")
CASES = [*FEW, *others(*(name for name in SCENES if name not in FEW))]


def rendered(device: Device, scene: Scene, spp: int = 5, **chosen: Any) -> tuple[Film, tuple[str, ...]]:
    """Return a film with light groups and their names."""
    files = chosen.pop("files", {})
    compiled = compile_scene(scene, Choices(device.lanes, device.layout, light_groups=True, **chosen), device=device)
    own = compiled.chosen_files
    compiled = replace(compiled, chosen_files=own | {name: file for name, file in files.items() if own[name]})
    session = SingleDeviceAccumulation(device, compiled, LaunchPlan.of(scene.render, spp))
    for _ in session.render(spp):
        pass
    return session.film(), compiled.groups


def sums(film: Film, name: str) -> Doubles:
    return np.asarray(film.pixels[name].astype(np.float64) + film.pixels[f"{name}_error"])


@pytest.mark.programs
@pytest.mark.parametrize("name", CASES)
def test_the_layers_add_up_to_the_image(name: str) -> None:
    """In any order in float32, bit for bit; and the image is the one without layers."""
    scene = SCENES[name]
    image = clrt.render(scene, spp=5, aovs="light_groups")
    layers = list(image.light_groups.values())
    assert tuple(image.light_groups) == light_groups(scene) and all(layer.min() >= 0 for layer in layers)
    generator = np.random.default_rng(TODAY)
    for order in (range(len(layers)), *(generator.permutation(len(layers)) for _ in range(4))):
        total = np.zeros_like(image.pixels)
        for number in order:
            total = total + layers[number]
        np.testing.assert_array_equal(total, image.pixels)
    np.testing.assert_array_equal(clrt.render(scene, spp=5).pixels, image.pixels)
    assert name == "no lights" or image.pixels.any()


@pytest.mark.programs
@pytest.mark.parametrize("name", CASES)
def test_no_light_is_lost_or_counted_twice(device: Device, name: str) -> None:
    """The sums of the groups, before they are rounded to add up exactly, add up but for float32 rounding. Samples that
    see a catcher are in none."""
    film, _ = rendered(device, SCENES[name])
    groups = film.pixels["groups"].astype(np.float64).sum(axis=(2, 3))
    expected = sums(film, "sum") - (sums(film, "caught") if name.count("catch") else 0)
    np.testing.assert_allclose(groups, expected, rtol=2e-6, atol=2e-6 * sums(film, "sum").max(initial=1))


@pytest.mark.programs
@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("lanes, paths", [(8, "waves"), (1, "queues")])
def test_every_execution_stores_the_same_groups(device: Device, name: str, lanes: int, paths: Paths) -> None:
    scene = SCENES[name]
    one, other = (followed(device, each, scene, lanes=lanes, light_groups=True) for each in ("lanes", paths))
    if device.is_pocl:
        np.testing.assert_array_equal(other.pixels["groups"], one.pixels["groups"])
    if paths == "queues":
        assert_equal(device, other, one)
    else:
        assert_same(other, one)


def darkened(scene: Scene, group: str, factor: float) -> Scene:
    """Return the scene with the light of all other groups multiplied by a factor, by the properties of its parts."""
    alone, dark = only_lit(scene, group), brighter(scene, factor)
    lit = {id(mine) for mine in alone.lights}
    lights: list[Light] = [mine if id(mine) in lit else theirs for mine, theirs in zip(scene.lights, dark.lights)]
    sky = scene.environment if scene.environment is alone.environment else dark.environment
    return with_materials(
        replace(scene, lights=lights, environment=sky),
        lambda each: each if (each.light_group or DEFAULT) == group else _dimmed(each, factor),
    )


def _dimmed(material: Any, factor: float) -> Any:
    parts = Scene(spheres=[Sphere(material=material)])
    return brighter(parts, factor).spheres[0].material


#: Random decisions that do not depend on how bright lights are.
UNIFORMLY = {"LIGHT_CHOICE": ["bench/uniform_choice.cl"]}
#: Numbers of random scenes: of two batches, which share programs.
RANDOM = (0, 1, 4)


def random_groups(number: int) -> Scene:
    """Return a random scene with random groups, other ones every day."""
    print(f"seed {TODAY}, scene {number}")
    return in_groups(random_scene(TODAY, number), Draws(TODAY, number, number))


@pytest.mark.programs
@pytest.mark.parametrize("number", ["grouped", *others(*RANDOM[1:]), RANDOM[0]])
def test_a_layer_is_the_image_in_its_lights_alone(device: Device, number: Any) -> None:
    """With the same random numbers, all lights being chosen with the same probability: sample by sample."""
    scene = grouped() if number == "grouped" else random_groups(number)
    film, groups = rendered(device, scene, files=UNIFORMLY)
    layers = group_layers(film, groups)
    for group, layer in zip(groups, layers):
        alone, _ = rendered(device, darkened(scene, group, OUT), files=UNIFORMLY)
        np.testing.assert_allclose(layer, alone.mean, rtol=1e-5, atol=2 * float(np.spacing(film.picture().max())))


@pytest.mark.programs
@pytest.mark.parametrize("number", ["grouped", *others(*RANDOM[1:]), RANDOM[0]])
def test_a_layer_scaled_is_the_image_with_its_lights_scaled(device: Device, number: Any) -> None:
    scene = grouped(1) if number == "grouped" else random_groups(number)
    film, groups = rendered(device, scene, files=UNIFORMLY)
    layers = group_layers(film, groups)
    for chosen, layer in zip(groups, layers):
        scaled, _ = rendered(device, brighter(darkened(scene, chosen, 0.125), 8.0), files=UNIFORMLY)
        relit = clrt.relight(_image_of(film, groups), {chosen: 8})
        np.testing.assert_allclose(
            relit.pixels, scaled.mean, rtol=1e-5, atol=8 * float(np.spacing(film.picture().max()))
        )
        np.testing.assert_array_equal(relit.pixels != film.picture(), layer != 0)


def _image_of(film: Film, groups: tuple[str, ...]) -> clrt.Image:
    layers = {f"light_group.{name}": layer for name, layer in zip(groups, group_layers(film, groups))}
    return clrt.Image(film.picture(), aovs=layers)  # type: ignore[arg-type]


def test_shares_add_up_in_any_order() -> None:
    """Of parts of any magnitudes whose sum was rounded; each is within a unit of the whole for each part."""
    generator = np.random.default_rng(TODAY)
    for count in range(1, MOST_GROUPS + 1):
        parts = generator.random((count, 400)) * 10.0 ** generator.uniform(-44, 30, (count, 400))
        parts *= generator.random((count, 400)) < 0.8
        whole = (parts.sum(axis=0) * (1 + generator.uniform(-1e-7, 1e-7, 400))).astype(np.float32)
        found = shares(whole, parts)
        layers = found.astype(np.float32)
        np.testing.assert_array_equal(layers, found)
        assert (np.abs(found - parts) <= (count + 2) * np.spacing(whole)).all() and not layers[parts == 0].any()
        for _ in range(4):
            total = np.zeros(400, np.float32)
            for number in generator.permutation(count):
                total += layers[number]
            np.testing.assert_array_equal(total, whole)


def test_groups_are_named_by_what_emits() -> None:
    """Sorted, the rest last; dark lights have their layer, and surfaces that do not emit none."""
    lamp = Diffuse(emission=(1, 1, 1))
    point = PointLight(position=(0, 3, 0), intensity=(1, 1, 1), light_group="b")
    assert light_groups(Scene()) == light_groups(Scene(spheres=[Sphere()])) == (DEFAULT,)
    assert light_groups(Scene(lights=[point], spheres=[Sphere()])) == ("b",)
    assert light_groups(Scene(lights=[point], spheres=[Sphere(material=lamp)])) == ("b", DEFAULT)
    assert light_groups(Scene(lights=[point], backdrop=Backdrop())) == ("b", DEFAULT)
    assert light_groups(Scene(lights=[replace(point, intensity=(0, 0, 0))])) == ("b",)
    named = replace(lamp, light_group="zoo")
    scene = Scene(instances=[clrt.Instance(everything().meshes[0], material=named)], lights=[point])
    assert light_groups(replace(scene, environment=Environment(color=(1, 1, 1), light_group="a"))) == ("a", "b", "zoo")


def test_the_sun_may_have_a_group_of_its_own() -> None:
    noon: dict[str, Any] = {"time": datetime.fromisoformat("2026-06-21T12:00+02:00"), "latitude": 50, "longitude": 10}
    for own, suns, names in (("day", "", ("day", "day")), ("day", "sun", ("day", "sun")), ("", "sun", ("", "sun"))):
        sky = clrt.Sky(**noon, light_group=own, sun_light_group=suns)
        assert (sky.environment().light_group, *(sun.light_group for sun in sky.lights())) == names
    with pytest.raises(SceneError, match='Sky.sun_light_group: "my sun" is not made of up to 100 letters, digits'):
        clrt.Sky(**noon, sun_light_group="my sun")


def test_mistakes() -> None:
    makers: list[tuple[Callable[[Any], object], str]] = [
        (lambda name: Environment(light_group=name), "Environment"),
        (lambda name: PointLight(position=(0, 3, 0), intensity=(1, 1, 1), light_group=name), "PointLight"),
        (lambda name: Diffuse(emission=(1, 1, 1), light_group=name), "Diffuse"),
    ]
    for make, kind in makers:
        make("Left-lamp_2" * 9)
        for name in ("a.b", "ä", "a b", "x" * 101, 3):
            with pytest.raises(ObjectError, match=rf"^{kind}.light_group: .* (is not made of|is not a string)"):
                make(name)
    many = Scene(
        lights=[
            PointLight(position=(0, 3, 0), intensity=(1, 1, 1), light_group=f"lamp{i}") for i in range(MOST_GROUPS + 1)
        ]
    )
    with pytest.raises(SceneError, match="the scene has 17 light groups .*; give some lights the same light_group"):
        clrt.render(many, aovs="light_groups")
    with pytest.raises(UsageError, match="the AOV light_groups stores light, and the integrator is local"):
        clrt.render(everything(), aovs="light_groups", integrator="local")


def test_most_groups_render() -> None:
    lights: list[Light] = [
        PointLight(position=(i - 8, 3, 0), intensity=(i + 1, 1, 1), light_group=f"lamp{i:02}")
        for i in range(MOST_GROUPS)
    ]
    image = clrt.render(replace(everything(), lights=lights, meshes=[], spheres=[Sphere()], environment=Environment()),
                        spp=2, aovs="light_groups")  # fmt: skip
    np.testing.assert_array_equal(np.sum([*image.light_groups.values()], axis=0, dtype=np.float32), image.pixels)
    assert len(image.light_groups) == MOST_GROUPS


@pytest.mark.programs
def test_only_what_is_asked_for_is_compiled() -> None:
    """A scene with names of groups has the program of one without them, unless layers are requested."""
    scene = grouped()
    bare = with_materials(
        replace(scene, lights=[replace(light, light_group="") for light in scene.lights]),
        lambda each: replace(each, light_group=""),
    )
    bare.environment = replace(scene.environment, light_group="")
    plain, asked = (compile_scene(scene, Choices(light_groups=each)) for each in (False, True))
    assert compile_scene(bare, Choices()).source == plain.source
    assert set(asked.features) - set(plain.features) == {"EMITTER_GROUPS"}
    assert set(asked.files) - set(plain.files) == {"light/groups.cl"}
    assert asked.pixel.itemsize - plain.pixel.itemsize == pytest.approx(24 * len(asked.groups), abs=31)
    assert set(asked.buffers) - set(plain.buffers) == {"emitter_groups"}


@pytest.mark.parametrize("more", [(), *others((["direct"],))], ids=str)
def test_a_checkpoint_keeps_the_groups(tmp_path: Path, more: Sequence[str]) -> None:
    path, scene, aovs = tmp_path / "a.ck", lamp_and_mirror(), ["light_groups", *more]
    for _ in clrt.Renderer(scene, spp=24, aovs=aovs, checkpoint=path).passes(spp=8):
        pass
    resumed = clrt.Renderer(scene, spp=24, aovs=aovs, checkpoint=path, resume=True)
    *_, state = resumed.passes(spp=24)
    whole = clrt.render(scene, spp=24, aovs=aovs).aovs
    found = resumed.aovs(state)
    assert list(found) == list(whole)
    for name, layer in found.items():
        np.testing.assert_array_equal(layer, whole[name])
    with pytest.raises(CheckpointError, match="of another render \\(with --aov light_groups\\)"):
        clrt.Renderer(scene, spp=24, aovs=more, checkpoint=path, resume=True)
    renamed = replace(scene, environment=replace(scene.environment, light_group="key"))
    with pytest.raises(CheckpointError, match="of another render \\(different environment\\)"):
        clrt.Renderer(renamed, spp=24, aovs=aovs, checkpoint=path, resume=True)


@pytest.mark.combinations
def test_several_devices_store_the_same_groups(device: Device) -> None:
    one, two = (
        clrt.render(grouped(), spp=8, aovs="light_groups", device=devices).light_groups
        for devices in ([device], [device, device])
    )
    for name, layer in one.items():
        np.testing.assert_array_equal(two[name], layer)


@pytest.mark.programs
def test_views_have_a_layer_of_each_group() -> None:
    scene = lamp_and_mirror()
    views = clrt.render_views(scene, [scene.camera], ["rgb", "light_groups", "depth"])
    layers = [name for name in views if name.startswith("light_group.")]
    assert list(views) == ["rgb", *(f"light_group.{name}" for name in light_groups(scene)), "depth"]
    np.testing.assert_array_equal(np.sum([views[name] for name in layers], axis=0, dtype=np.float32), views["rgb"])


def test_a_lamp_in_a_mirror_is_in_its_group() -> None:
    """Seen directly, in a mirror, and through what lets light pass: all of its light, and no other group's."""
    found = clrt.render(lamp_and_mirror(), aovs="light_groups").light_groups
    assert not found["sky"][..., [0, 2]].any() and found["sky"].any()
    np.testing.assert_allclose(found["lamp"] / [3, 2, 1], found["lamp"][..., :1] / np.full(3, 3), rtol=1e-5)
    assert found["lamp"].max() == 3
