"""Options offer exactly the available choices, which are written out so that --help loads nothing."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable, Iterator
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from clrt.accel.traversal_kernels import BOX_TESTS, BUILDER_NAMES, SPHERE_TESTS, TREES, TRIANGLE_TESTS
from clrt.cli import bench_rays, commands, debug, info, render
from clrt.errors import DeviceError
from clrt.rendering.compile.choices import OFFSETS

KNOWN: dict[str, Iterable[str]] = {
    "triangle": TRIANGLE_TESTS,
    "box": BOX_TESTS,
    "sphere": SPHERE_TESTS,
    "offset": OFFSETS,
    "layout": TREES,
    "builder": BUILDER_NAMES,
}


@pytest.mark.parametrize(
    "command, names",
    [
        (render.command, KNOWN),
        (info.command, KNOWN),
        (debug.command, KNOWN),
        (bench_rays.rays_command, ["triangle", "box", "layout", "builder"]),
    ],
    ids=["render", "info", "debug", "bench rays"],
)
def test_options_offer_what_there_is(command: click.Command, names: Iterable[str]) -> None:
    options = {option.name: option.type for option in command.params}
    for name in names:
        offered = options[name]
        assert isinstance(offered, click.Choice) and set(offered.choices) == set(KNOWN[name])


def leaves(group: click.Group) -> Iterator[click.Command]:
    """Yield all commands of a group and of the groups in it."""
    for name in group.list_commands(click.Context(group)):
        each = group.get_command(click.Context(group), name)
        assert each
        if isinstance(each, click.Group):
            yield from leaves(each)
        else:
            yield each


def test_misspelled_values_are_corrected() -> None:
    """The error for a word with a letter too many suggests the word, in every option of every command."""
    words = 0
    for command in leaves(commands):
        for option in command.params:
            if isinstance(option.type, click.Choice) and isinstance(option.type.choices[0], str):
                word = max(option.type.choices, key=len)
                with pytest.raises(click.BadParameter, match=f"; did you mean {word}\\?$"):
                    option.type.convert(f"{word}x", option, click.Context(command))
                words += 1
    assert words > 40


def test_what_is_chosen_is_compiled(tmp_path: Path) -> None:
    """`clrt info` lists the chosen files, and `clrt render --print-kernel` prints them."""
    scene = tmp_path / "ball.toml"
    scene.write_text("[[sphere]]\n[[mesh]]\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\n")
    chosen = ["--triangle", "precomputed", "--box", "plain", "--sphere", "textbook", "--offset", "ulp", "--lanes", "1"]
    listed = CliRunner().invoke(info.command, [str(scene), "--json", *chosen], catch_exceptions=False)
    printed = CliRunner().invoke(render.command, [str(scene), "--print-kernel", "-q", *chosen], catch_exceptions=False)
    logging.disable(logging.NOTSET)  # -q has switched it off
    for file in (
        "geometry/triangle_precomputed.cl",
        "geometry/box_plain.cl",
        "geometry/sphere_textbook.cl",
        "offset/ulp.cl",
    ):
        assert file in json.loads(listed.stdout)["files"] and f'"{file}"' in printed.stdout


def test_info_is_of_the_device_that_would_render(tmp_path: Path) -> None:
    """With a device the builder is ploc, for which sah stands in without one; an unknown device is refused."""
    scene = tmp_path / "two.toml"
    scene.write_text(
        "[[mesh]]\nvertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 1]]\nfaces = [[0, 1, 2], [1, 3, 2]]\n"
    )
    options = [str(scene), "--json", "--builder", "ploc", "--layout", "bvh2"]
    listed = CliRunner().invoke(info.command, options, catch_exceptions=False)
    assert json.loads(listed.stdout)["tree"]["builder"] == "ploc"
    refused = CliRunner().invoke(info.command, [*options, "--device", "no such device"])
    assert isinstance(refused.exception, DeviceError)


def test_help_has_whole_sentences() -> None:
    """The summary of every command is a whole sentence, not truncated to a line."""
    _, told = CliRunner().invoke(commands, ["--help"], catch_exceptions=False).output.split("Commands:")
    told = " ".join(told.split())
    assert told.startswith("render Render SCENE until ") and " is reached. view Show SCENE, " in told
    assert "..." not in told
