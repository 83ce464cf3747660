"""Types of command-line options."""

from __future__ import annotations

import re
from math import isfinite
from typing import Any

import click

from ..errors import did_you_mean


class Size(click.ParamType[tuple[int, int]]):
    """WIDTHxHEIGHT in pixels, e.g. 1920x1080."""

    name = "WxH"

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> tuple[int, int]:
        match = re.fullmatch(r"(\d+)[xX](\d+)", str(value))
        if not match or not all(1 <= int(n) <= 65536 for n in match.groups()):
            self.fail(f"{value!r} is not a size; write WIDTHxHEIGHT, each 1 to 65536, e.g. 640x480", param, context)
        return int(match[1]), int(match[2])


class TexelSize(Size):
    """WIDTHxHEIGHT in texels, or one number for a square, e.g. 1024."""

    name = "N"

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> tuple[int, int]:
        text = str(value)
        return super().convert(f"{text}x{text}" if text.isdecimal() else text, param, context)


class Pixel(click.ParamType[tuple[int, int]]):
    """X,Y of a pixel, e.g. 120,64."""

    name = "X,Y"

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> tuple[int, int]:
        match = re.fullmatch(r"(\d{1,9}),(\d{1,9})", str(value))
        if not match:
            self.fail(f"{value!r} is not a pixel; write X,Y, its column and row from 0, e.g. 120,64", param, context)
        return int(match[1]), int(match[2])


class Assignment(click.ParamType[tuple[str, str]]):
    """NAME=VALUE."""

    name = "NAME=VALUE"

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> tuple[str, str]:
        name, equals, text = str(value).partition("=")
        if not name or not equals:
            self.fail(f"{value!r} gives no value; write NAME=VALUE, e.g. spp=64", param, context)
        return name, text


class Factors(click.ParamType[tuple[str, tuple[float, ...]]]):
    """NAME=FACTOR, or NAME=R,G,B."""

    name = "NAME=FACTOR"

    def convert(
        self, value: Any, param: click.Parameter | None, context: click.Context | None
    ) -> tuple[str, tuple[float, ...]]:
        name, _, text = str(value).partition("=")
        try:
            numbers = tuple(map(float, text.split(",")))
        except ValueError:
            numbers = ()
        if not name or len(numbers) not in (1, 3):
            self.fail(f"{value!r} gives no factor; write NAME=FACTOR or NAME=R,G,B, e.g. key=0.5", param, context)
        return name, numbers


class OneOf(click.Choice[Any]):
    """One of several words, which the error for a misspelled one suggests."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        message = super().get_invalid_choice_message(value, ctx)
        meant = did_you_mean(value, self.choices)
        return message.removesuffix(".") + meant if meant else message


class Finite(click.FloatRange):
    """Range that excludes NaN and infinity, which all of click's ranges include."""

    def convert(self, value: Any, param: click.Parameter | None, context: click.Context | None) -> float:
        number: float = super().convert(value, param, context)
        if not isfinite(number):
            self.fail(f"{value!r} is not a finite number; give a finite one", param, context)
        return number
