"""Identity of the image of a checkpoint, frame, band or report: every setting counts unless it is exempted by name."""

from __future__ import annotations

import copy
import inspect
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, is_dataclass, make_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clrt
from clrt.accel.traversal_kernels import HitTests
from clrt.cli.frames import FILES, FrameSequence
from clrt.cli.goal import Goal
from clrt.cli.outputs import Outputs
from clrt.device.open import Device
from clrt.errors import SceneError
from clrt.farm.banded_picture import BandedPicture
from clrt.farm.orders import PictureOrder
from clrt.live.settings import Settings
from clrt.rendering.checkpoint.identity import (
    CODE,
    ENDS,
    NAMES,
    ROUNDING,
    code_digest,
    differences,
    facts_of,
    scene_hash,
)
from clrt.rendering.compile.choices import Choices
from clrt.rendering.compile.visible_parts import UNSEEN
from clrt.rendering.render_report import render_report
from clrt.rendering.renderer_options import choices_of, settings_of
from clrt.scene.camera_path import turntable
from clrt.scene.lights import DirectionalLight, PointLight, SpotLight
from clrt.scene.materials.material_types import MATERIALS
from clrt.scene.materials.textures import Picture, Texture
from clrt.scene.model import RenderSettings, Scene

from ..covering import others

#: A value other than the default for each setting and choice.
OTHER: dict[str, Any] = {
    "size": (24, 16),
    "spp": 3,
    "error": 0.3,
    "max_depth": 3,
    "seed": 7,
    "integrator": "direct",
    "shadows": False,
    "sampler": "independent",
    "filter": "tent",
    "adaptive": True,
    "back_face_culling": "all",
    "clamp_direct": 1.5,
    "clamp_indirect": 2.5,
    "transparent": True,
    "transparent_glass": True,
    "lanes": 1,
    "layout": "bvh2",
    "builder": "midpoint",
    "offset": "ulp",
    "direct_light": True,
    "light_groups": True,
    "paths": "lanes",
    "guiding": "on",
    "tree": True,
    "first_hits": True,
    "triangle": "precomputed",
    "box": "plain",
    "sphere": "textbook",
}
TESTS = [each.name for each in fields(HitTests)]
SETTINGS = [each.name for each in fields(RenderSettings)]
CHOICES = [each.name for each in fields(Choices) if each.name != "tests"]
WHITE, DOWN = (1.0, 1.0, 1.0), (0.0, -1.0, 0.0)
LIGHTS = [
    PointLight(position=(0.0, 3.0, 0.0), intensity=WHITE),
    DirectionalLight(direction=DOWN, irradiance=WHITE),
    SpotLight(position=(0.0, 3.0, 0.0), direction=DOWN, intensity=WHITE),
]
#: The only ones that users cannot set directly.
BY_AOVS = {"direct_light": "direct", "light_groups": "light_groups"}


def scene(**given: Any) -> Scene:
    texture = Texture(picture=Picture(np.zeros((2, 2, 4), np.uint8)))
    points, faces = np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32)
    mesh = clrt.Mesh(points, faces, clrt.Diffuse(color=texture), uv=points[:, :2])
    return Scene(
        **{"meshes": [mesh], "instances": [clrt.Instance(mesh)], "spheres": [clrt.Sphere()], "lights": LIGHTS, **given}
    )


def changed(settings: RenderSettings, choices: Choices, name: str) -> tuple[RenderSettings, Choices]:
    """Return both with another value for one field."""
    if name in SETTINGS:
        return replace(settings, **{name: OTHER[name]}), choices
    if name in TESTS:
        return settings, replace(choices, tests=replace(choices.tests, **{name: OTHER[name]}))
    return settings, replace(choices, **{name: OTHER[name]})


def test_no_name_is_without_an_example() -> None:
    """OTHER covers every field, so that added fields are tested below."""
    assert {*SETTINGS, *CHOICES, *TESTS} == OTHER.keys()


@pytest.mark.parametrize("name", [*SETTINGS, *CHOICES, *TESTS])
def test_every_setting_and_choice_counts_but_for_those_named(name: str) -> None:
    content, choices = scene(), Choices()
    settings, chosen = changed(content.render, choices, name)
    told = differences(facts_of(content, choices), facts_of(replace(content, render=settings), chosen))
    assert bool(told) == (name not in ENDS | ROUNDING), told
    assert all(name in each or name == "direct_light" for each in told)


def test_what_is_added_counts_by_itself() -> None:
    """An added setting, choice, part of a scene or material parameter changes the identity without further code."""

    def more(kind: type, value: object) -> Any:
        return make_dataclass(
            f"More{kind.__name__}",
            [("novel", object, field(default=value, kw_only=True))],
            bases=(kind,),
            frozen=getattr(kind, "__dataclass_params__").frozen,
            eq=False,
        )

    for kind, made in (
        (RenderSettings, lambda new: (scene(render=new()), Choices())),
        (Choices, lambda new: (scene(), new())),
        (Scene, lambda new: (new(), Choices())),
        (clrt.Diffuse, lambda new: (scene(spheres=[clrt.Sphere(material=new())]), Choices())),
    ):
        one, other = (facts_of(*made(more(kind, value))) for value in (1, 2))
        assert differences(one, other) and differences(other, one), kind
    assert differences({**facts_of(scene(), Choices()), "novel": "1"}, facts_of(scene(), Choices()))


def test_any_edit_of_the_code_that_samples_depend_on_counts(tmp_path: Path) -> None:
    """A changed, added, renamed or removed Python file, and nothing else."""
    for folder in CODE:
        (tmp_path / folder / "inner").mkdir(parents=True)
        (tmp_path / folder / "inner" / "a.py").write_text("x = 1\n")
    code_of = code_digest.__wrapped__
    found = [code_of(tmp_path)]
    for folder in CODE:
        file = tmp_path / folder / "inner" / "a.py"
        for change in (
            lambda: file.write_text("x = 2\n"),
            lambda: file.rename(file.with_name("b.py")),
            lambda: file.with_name("c.py").write_text(""),
            lambda: file.with_name("b.py").unlink(),
        ):
            change()
            found.append(code_of(tmp_path))
    assert len(set(found)) == len(found) == 1 + 4 * len(CODE)
    (tmp_path / "other.py").write_text("y = 1\n")
    assert code_of(tmp_path) == found[-1]


def test_no_other_package_takes_part_in_samples() -> None:
    """The packages that a renderer imports are known: those in CODE, and those that do not determine samples."""
    program = "import sys, clrt.rendering.renderer; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    counted = tuple(f"clrt.{folder.replace('/', '.')}." for folder in CODE)
    others = {
        name.split(".")[1]
        for name in done.stdout.split()
        if name.startswith("clrt.") and not f"{name}.".startswith(counted)
    }
    assert others == {
        "accel",  # affects rounding only
        "device",
        "awake",
        "threads",  # compile and launch, in any order
        "formats",  # file names of scenes
        "aov_types",  # names of AOVs; `direct_light`, which one needs, is a choice
        "errors",
        "option_fields",
        "file_names",
        "file_mode",
        "float_errors",
    }


def things(value: Any) -> Iterator[Any]:
    """Yield all dataclasses within a part of a scene."""
    if isinstance(value, list | tuple):
        for each in value:
            yield from things(each)
    elif is_dataclass(value):
        yield value
        for each in fields(value):
            yield from things(getattr(value, each.name))


def test_every_field_of_all_that_is_seen_counts() -> None:
    """Replacing any field of any object by a number changes the scene's hash, unless the field is a name."""
    parts = [each.name for each in fields(Scene) if each.name not in UNSEEN]
    for material in MATERIALS:
        content = scene(spheres=[clrt.Sphere(material=material())])
        found = scene_hash(content)
        for part in parts:
            for thing in things(getattr(content, part)):
                for each in fields(thing):
                    value = getattr(thing, each.name)
                    other_value = "other" if isinstance(value, str) else 12.34
                    object.__setattr__(thing, each.name, [12.34] if isinstance(value, list) else other_value)
                    try:
                        other = None if is_dataclass(value) else scene_hash(content)
                    except (AttributeError, SceneError):  # the hash made a copy, or read an attribute of that field
                        other = None
                    object.__setattr__(thing, each.name, value)
                    assert (other != found) == (each.name not in NAMES) or is_dataclass(value), (thing, each.name)
        assert scene_hash(content) == found


def test_unknown_content_is_refused() -> None:
    """Values that cannot be hashed are rejected."""
    content = scene()
    content.lights = [object()]  # type: ignore[list-item]
    with pytest.raises(TypeError):
        scene_hash(content)


#: Only a stop condition; as such an argument of `passes`.
STOP = {"error"}


#: Those with which scenes are rendered by default, as each has a program of its own.
RENDERED = ("integrator", "max_depth", "transparent")
SOME = [name for name in SETTINGS if name not in STOP]


def options_of(device: Device, name: str) -> tuple[Scene, dict[str, Any]]:
    """Return a scene, and options of its render with another value for one field."""
    options: dict[str, Any] = {"size": (8, 8), "device": device.info.index}
    options |= {"aovs": (BY_AOVS[name],)} if name in BY_AOVS else {name: OTHER[name]}
    sky = clrt.Environment(color=(1.0, 1.0, 1.0))
    return scene(meshes=[], instances=[], spheres=[], lights=[], environment=sky), options


@pytest.mark.parametrize("name", [*SOME, *CHOICES, *TESTS])
def test_options_and_orders_have_every_one(device: Device, name: str) -> None:
    """Renderer options include every one, and the farm's orders map it to the same choices."""
    content, options = options_of(device, name)
    assert options.keys() <= inspect.signature(clrt.Renderer).parameters.keys()
    order, wanted = PictureOrder(content, options), changed(content.render, Choices(), name)
    assert order.choices == choices_of(options) == wanted[1]
    assert order.settled.render == settings_of(content.render, options) == replace(wanted[0], size=options["size"])


@pytest.mark.parametrize(
    "name", [*RENDERED, *others(*(name for name in (*SOME, *CHOICES, *TESTS) if name not in RENDERED))]
)
def test_renderer_and_report_have_every_one(device: Device, name: str) -> None:
    """The report lists it, unless it only ends the image or affects rounding alone."""
    content, options = options_of(device, name)
    renderer, order = clrt.Renderer(content, **options), PictureOrder(content, options)
    assert renderer.choices == order.choices and renderer.settings == order.settled.render
    if name not in ENDS | ROUNDING | {"size"}:
        *_, state = renderer.passes(spp=1)
        assert render_report(renderer, state)[name] == OTHER[name]


@pytest.mark.parametrize(
    "change",
    [
        {"spp": 5},
        {"time": 1.0},
        {"error": 0.5},
        {"denoise": True},
        {"seed": 3},
        {"error_percentile": 90.0},
        {"offset": "ulp"},
        {"novel": 1},
    ],
    ids=str,
)
def test_bands_are_of_one_order(change: dict[str, Any]) -> None:
    """Bands of orders that differ in any option, known or not, are not mixed; the device may differ."""
    order = PictureOrder(scene(), {"seed": 1, "error_percentile": 95.0, "device": 0}, spp=4)
    in_order = {each.name for each in fields(order)}
    other = replace(
        order,
        **{name: value for name, value in change.items() if name in in_order},
        options=order.options | {name: value for name, value in change.items() if name not in in_order},
    )
    facts = [BandedPicture(each, Path("a"))._facts() for each in (order, other)]
    assert differences(*facts) and not differences(facts[0], facts[0])
    elsewhere = replace(order, options=order.options | {"device": 1})
    assert not differences(facts[0], BandedPicture(elsewhere, Path("b"))._facts())


def test_frames_are_of_one_goal_and_one_view(tmp_path: Path) -> None:
    """The frame hash depends on every field of Goal and of Outputs that is not a file."""
    outputs = Outputs((), (tmp_path / "#.png",), (), False, "srgb", 0.0, None, None)
    goal, content = Goal(4, None, 0.5, 95.0), scene()

    def hash_of(outputs: Outputs, goal: Goal) -> Any:
        sequence = FrameSequence(outputs, (), None, False)
        sequence._moving, sequence.remaining = turntable(content, 1), 1
        return next(sequence.left(content, Choices(), goal))[0].header["frame_hash"]

    first = hash_of(outputs, goal)
    assert first == hash_of(copy.copy(outputs), copy.copy(goal))
    for each in fields(goal):
        assert hash_of(outputs, replace(goal, **{each.name: 7})) != first, each.name
    for each in fields(outputs):
        if each.name not in FILES:
            novel: Any = ("depth",) if each.name == "aovs" else 7
            assert hash_of(replace(outputs, **{each.name: novel}), goal) != first, each.name


def test_live_settings_are_given_to_the_renderer() -> None:
    """Added settings are passed on, too."""

    @dataclass(frozen=True, kw_only=True)
    class More(Settings):
        box: str = "plain"

    assert More().tracing == Settings().tracing | {"box": "plain"}
    assert Settings().tracing.keys() <= {*CHOICES, *TESTS}
