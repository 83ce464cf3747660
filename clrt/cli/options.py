"""Option types and groups shared by several commands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import click

from ..accel.methods import HitTests
from ..rendering.compile.choices import Choices
from ..scene.render_settings import RenderSettings
from .option_groups import settings_options

F = TypeVar("F", bound=Callable[..., Any])


#: Help of --camera.
CAMERA = "Camera of the scene or model file to use; see `clrt info`. For a bare model also: front, right, back, left."
#: Options that are not called like their setting.
NAMES = {"max_depth": "--depth"}


def picture_options(command: F) -> F:
    """Add the options that, together with the scene's own settings, determine every sample of an image."""
    command = settings_options(RenderSettings, NAMES, without=("spp",), defaults=False)(command)
    return click.option("--camera", metavar="NAME", help=CAMERA)(command)


def tracing_options(command: F) -> F:
    """Add the options for tracing methods: the defaults suit the device; others are for comparison."""
    command = settings_options(HitTests)(command)
    return cast(F, settings_options(Choices, without=("first_hits",))(command))


def hit_options(command: F) -> F:
    """Add the intersection tests of a mesh."""
    return cast(F, settings_options(HitTests, without=("sphere",))(command))
