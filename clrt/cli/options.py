"""Option types and groups shared by several commands."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import isfinite
from typing import Any, TypeVar

import click

F = TypeVar("F", bound=Callable[..., Any])


class CommandGroup(click.Group):
    """Group of commands that suggests the closest name for a misspelled one."""

    def resolve_command(self, context: click.Context, arguments: list[str]
                        ) -> tuple[str | None, click.Command | None, list[str]]:
        if arguments and not arguments[0].startswith("-") and self.get_command(context, arguments[0]) is None:
            from ..scene.validation.field_types import unknown  # imports numpy, which valid commands do not need yet

            context.fail(f'command "{arguments[0]}" {unknown(arguments[0], self.list_commands(context))}')
        return super().resolve_command(context, arguments)

    def format_commands(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Each with the whole first sentence of its help, which click cuts to a line."""
        commands = ((name, self.get_command(context, name)) for name in self.list_commands(context))
        rows = [(name, command.get_short_help_str(limit=10_000)) for name, command in commands if command is not None]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


class Size(click.ParamType[tuple[int, int]]):
    """WIDTHxHEIGHT in pixels, e.g. 1920x1080."""

    name = "WxH"

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> tuple[int, int]:
        match = re.fullmatch(r"(\d+)[xX](\d+)", str(value))
        if not match or not all(1 <= int(n) <= 65536 for n in match.groups()):
            self.fail(f"{value!r} is not a size; write WIDTHxHEIGHT, each 1 to 65536, e.g. 640x480", param, context)
        return int(match[1]), int(match[2])


class Pixel(click.ParamType[tuple[int, int]]):
    """X,Y of a pixel, e.g. 120,64."""

    name = "X,Y"

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> tuple[int, int]:
        match = re.fullmatch(r"(\d{1,9}),(\d{1,9})", str(value))
        if not match:
            self.fail(f"{value!r} is not a pixel; write X,Y, its column and row from 0, e.g. 120,64", param, context)
        return int(match[1]), int(match[2])


class Finite(click.FloatRange):
    """Range that excludes NaN and infinity, which all of click's ranges include."""

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> float:
        number: float = super().convert(value, param, context)
        if not isfinite(number):
            self.fail(f"{value!r} is not a finite number; give a finite one", param, context)
        return number


#: Help of --camera.
CAMERA = "Camera of the scene or model file to use; see `clrt info`. For a bare model also: front, right, back, left."
triangle_option = click.option(
    "--triangle", type=click.Choice(["watertight", "moller_trumbore", "precomputed", "baldwin_weber"]),
    default="watertight", show_default=True, help="Triangle intersection test.")
box_option = click.option("--box", type=click.Choice(["robust", "plain"]), default="robust", show_default=True,
                          help="Box intersection test.")


def picture_options(command: F) -> F:
    """Add the options that, together with the scene's own settings, determine every sample of an image."""
    for option in reversed([
        click.option("--camera", metavar="NAME", help=CAMERA),
        click.option("--size", type=Size(), help="Image size in pixels."),
        click.option("--depth", type=click.IntRange(1, 1024),
                     help="Maximum path depth: 1 emission only, 2 direct light, 3 one bounce."),
        click.option("--seed", type=click.IntRange(0, 2**32 - 1), help="Seed of the random number generator."),
        click.option("--sampler", type=click.Choice(["sobol", "stratified", "independent"]),
                     help="Sample sequence; default: the scene's."),
        click.option("--filter", "pixel_filter", type=click.Choice(["box", "tent", "blackman_harris", "gaussian"]),
                     help="Pixel filter; default: the scene's."),
        click.option("--back-face-culling", type=click.Choice(["none", "camera", "all"]),
                     help="Which rays ignore the back faces of materials that are not double-sided."),
        click.option("--clamp-direct", type=Finite(min=0), metavar="X",
                     help="Clamp each contribution of direct light to a sample to this value; 0: no clamp."),
        click.option("--clamp-indirect", type=Finite(min=0), metavar="X",
                     help="The same for indirect light: fewer fireflies, but the image is biased (too dark)."),
    ]):
        command = option(command)
    return command


def tracing_options(command: F) -> F:
    """Add the options for tracing methods: the defaults suit the device; others are for comparison."""
    for option in [
        click.option("--lanes", type=click.Choice(["1", "8", "16"]), help="SIMD width: paths per work-item.",
                     callback=lambda context, parameter, value: int(value) if value else None),
        click.option("--paths", type=click.Choice(["lanes", "waves"]),
                     help="lanes: megakernel; waves: wavefront with compaction (needs 8 lanes). Default: by device."),
        triangle_option,
        box_option,
        click.option("--sphere", type=click.Choice(["robust", "textbook"]), default="robust", show_default=True,
                     help="Sphere intersection test."),
        click.option("--offset", type=click.Choice(["bound", "ulp", "fixed"]), default="bound", show_default=True,
                     help="Offset of ray origins from the surface: its rounding error bound, a few ulps, or 0.001."),
        click.option("--builder", type=click.Choice(["ploc", "reinsertion", "sah", "midpoint"]),
                     help="BVH builder; default: sah for small scenes, ploc on the device for large ones."),
        click.option("--layout", type=click.Choice(["bvh8", "bvh2", "cwbvh", "packs", "list"]),
                     help="BVH layout; packs (for small scenes) and list use no BVH."),
        click.option("--tree", type=click.Choice(["on", "off"]),
                     help="Use a BVH, or intersect every ray with all primitives (brute force); default: the faster.",
                     callback=lambda context, parameter, value: value and value == "on"),
    ]:
        command = option(command)
    return command
