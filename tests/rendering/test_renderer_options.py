"""Keywords of Renderer, render and animate: stated once, listed, described and checked."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from types import NoneType, SimpleNamespace
from typing import Any, Literal, get_args, get_origin, get_type_hints

import pytest

import clrt
from clrt.accel.methods import HitTests
from clrt.device.device_info import Paths, Tuning
from clrt.device.open import Device
from clrt.errors import UsageError
from clrt.rendering.checkpoint.policy import CheckpointPolicy
from clrt.rendering.compile.choices import Choices
from clrt.rendering.renderer import Renderer
from clrt.rendering.renderer_options import (
    CheckpointOptions,
    PictureOptions,
    RendererOptions,
    TracingOptions,
    checkpoints_of,
)
from clrt.scene.model import RenderSettings, Scene

#: Fields of settings objects that are not keywords of these: `tests` is made of HitTests, `error` is that of the stop
#: conditions, the others follow from the AOVs.
NO_KEYWORDS = {"tests", "error", "direct_light", "light_groups"}
#: Names that the keywords' types contain, which are known only where Renderer is.
KNOWN = {"Renderer": Renderer}
CALLS: dict[str, Callable[..., Any]] = {"Renderer": clrt.Renderer, "render": clrt.render, "animate": clrt.animate}


def hints_of(*kinds: type) -> dict[str, Any]:
    return {name: hint for kind in kinds for name, hint in get_type_hints(kind, localns=KNOWN).items()}


def plain(hint: Any) -> set[Any]:
    """Return the types that a hint allows, without None, each Literal as the type of its values."""
    parts = get_args(hint) if NoneType in get_args(hint) else (hint,)
    return {type(get_args(part)[0]) if get_origin(part) is Literal else part for part in parts} - {NoneType}


@pytest.mark.parametrize(
    "options, kinds",
    [
        (PictureOptions, [RenderSettings]),
        (TracingOptions, [Choices, HitTests]),
        (CheckpointOptions, [CheckpointPolicy]),
    ],
)
def test_keywords_are_the_fields_of_settings(options: type, kinds: list[type]) -> None:
    """By name and type; lists of allowed values are the same."""
    stated, meant = hints_of(options), hints_of(*kinds)
    assert stated.keys() == meant.keys() - NO_KEYWORDS
    for kind in kinds:
        for field in fields(kind):
            if field.name not in NO_KEYWORDS:
                assert plain(stated[field.name]) == plain(meant[field.name]), field.name
                literals = [
                    part for part in (stated[field.name], *get_args(stated[field.name])) if get_origin(part) is Literal
                ]
                values = [*field.metadata["values"]]
                if values and bool not in plain(stated[field.name]):
                    assert [*get_args(literals[0])] == values, field.name


@pytest.mark.parametrize("name", CALLS)
def test_keywords_are_listed_and_described(name: str) -> None:
    """In the signature, which editors show, and in the docstring, which help() shows."""
    listed, text = inspect.signature(CALLS[name]).parameters, inspect.getdoc(CALLS[name]) or ""
    assert all(each.kind is not inspect.Parameter.VAR_KEYWORD for each in listed.values())
    described = {
        line.split(":")[0].strip("- "): line.split(":", 1)[1].strip()
        for line in text.split("Keywords:")[1].splitlines()
        if ":" in line
    }
    for keyword in hints_of(RendererOptions):
        assert listed[keyword].kind is inspect.Parameter.KEYWORD_ONLY and described[keyword]
    assert listed["triangle"].default == "watertight" and listed["checkpoint_seconds"].default == 30.0
    assert listed["max_depth"].default is None


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize("wrong, meant", [("max_dept", "max_depth"), ("ssp", "spp"), ("integrater", "integrator")])
def test_misspelled_keywords_are_refused(name: str, wrong: str, meant: str) -> None:
    with pytest.raises(UsageError, match=f'{name}: the option "{wrong}" is unknown; did you mean "{meant}"?'):
        CALLS[name](Scene(), **{wrong: 1})


def test_choices_suit_the_device() -> None:
    """What is chosen stays; the rest is the device's: what its trial found, else what suits its type. Waves need 8
    lanes that are packed by one instruction, queues 1."""

    class Fake:
        def __init__(self, lanes: int, packs: bool, kind: str = "cpu", measured: Paths | None = None) -> None:
            self.lanes, self.packs = lanes, packs
            tuning = Tuning(measured, "cwbvh", 64) if measured else None
            self.info = SimpleNamespace(type=kind, tuning=tuning)

    def on(*of_device: Any, **chosen: Any) -> tuple[int, str]:
        found = Choices(**chosen).on(Fake(*of_device))  # type: ignore[arg-type]
        assert found.on(Fake(16, False)) == found  # type: ignore[arg-type]
        return found.lanes, found.paths

    assert on(8, True) == (8, "waves") and on(8, False) == (8, "lanes") and on(1, True) == (1, "lanes")
    assert on(1, True, lanes=8) == (8, "waves") and on(8, True, lanes=16) == (16, "lanes")
    assert on(8, False, paths="waves") == (8, "waves") and on(8, True, paths="lanes") == (8, "lanes")
    assert on(1, False, "gpu") == (1, "queues") and on(1, False, "gpu", paths="lanes") == (1, "lanes")
    assert on(8, True, paths="queues") == (1, "queues")
    assert on(1, False, "gpu", "lanes") == (1, "lanes") and on(8, True, "cpu", "lanes") == (8, "lanes")
    assert on(8, False, "cpu", "waves") == (8, "waves") and on(1, False, "cpu", "queues") == (1, "queues")
    assert on(1, False, "gpu", "waves") == (1, "queues") and on(8, True, "cpu", "queues") == (8, "waves")
    with pytest.raises(UsageError, match="paths = waves needs 8 lanes, not 1"):
        on(1, True, paths="waves")


def test_none_is_not_given(device: Device, tmp_path: Path) -> None:
    """Keywords that are None have the defaults, so that programs may pass on their own options."""
    names = ["size", "triangle", "lanes", "aovs", "on_phase", "before", "checkpoint_seconds", "first_hits"]
    options: dict[str, Any] = dict.fromkeys(names)
    renderer = Renderer(Scene(), device=device.info.index, **options)
    assert renderer.settings == RenderSettings() and renderer.choices == Choices()
    assert checkpoints_of({"checkpoint": tmp_path / "a.ck", "resume": None}) == CheckpointPolicy(tmp_path / "a.ck")


def test_wrong_keywords_are_wrong_types_too() -> None:
    """mypy reports an unused `type: ignore` if it accepts one of these."""
    with pytest.raises(UsageError, match="max_depth"):
        clrt.Renderer(Scene(), max_dept=3)  # type: ignore[call-arg]
    with pytest.raises(UsageError, match="octree"):
        clrt.render(Scene(), layout="octree")  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="spp"):
        clrt.render(Scene(), spp="3")  # type: ignore[arg-type]
