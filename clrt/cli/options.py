"""Option types and groups shared by several commands."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from ..accel.methods import HitTests
from ..rendering.compile.choices import Choices
from ..scene.render_settings import RenderSettings
from .load_options import LoadOptions
from .option_groups import grouped, settings_options

F = TypeVar("F", bound=Callable[..., Any])


#: Options that are not called like their setting.
NAMES = {"max_depth": "--depth"}


def picture_options(command: F) -> F:
    """Add the options that, together with the scene's own settings, determine every sample of an image."""
    command = settings_options(RenderSettings, NAMES, without=("spp",), defaults=False)(command)
    return cast(F, grouped("loading", LoadOptions)(command))


def tracing_options(command: F) -> F:
    """Add the options for tracing methods: the defaults suit the device; others are for comparison."""
    command = settings_options(HitTests)(command)
    return cast(F, settings_options(Choices, without=("first_hits",))(command))


def hit_options(command: F) -> F:
    """Add the intersection tests of a mesh."""
    return cast(F, settings_options(HitTests, without=("sphere",))(command))
