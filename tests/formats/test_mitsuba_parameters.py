"""Parameters $NAME of Mitsuba's scenes, given with -D or in Python."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner

from clrt.api import load
from clrt.cli.convert import command as convert
from clrt.cli.debug import command as debug
from clrt.cli.info import command as info
from clrt.cli.render import command as render
from clrt.errors import SceneError, UsageError

SCENE = """<scene version="3.0.0"><default name="shade" value="0.25"/><default name="size" value="$width"/>
    <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="$size"/>
    <integer name="height" value="3"/></film></sensor>
    <shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="$shade, 0, 0"/></bsdf></shape></scene>"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "a.xml"
    path.write_text(SCENE)
    return path


def test_parameters_replace_defaults(path: Path) -> None:
    """Also one without a default, which a default refers to."""
    read = load(path, parameters={"width": "7"})
    assert read.render.size == (7, 3) and read.spheres[0].material.parameters()["color"] == (0.25, 0, 0)
    read = load(path, parameters={"width": "7", "shade": "0.5", "size": "9"})
    assert read.render.size == (9, 3) and read.spheres[0].material.parameters()["color"] == (0.5, 0, 0)


def test_the_command_line_gives_them(path: Path) -> None:
    """The last one of a name counts, as of other options; a value may contain an equals sign."""
    target = path.with_suffix(".toml")
    done = CliRunner().invoke(convert, [str(path), str(target), "-D", "width=1=1", "--define", "width=12"])
    assert done.exit_code == 0 and load(target).render.size == (12, 3), done.output


@pytest.mark.parametrize("command", [render, info, convert, debug])
def test_commands_that_load_scenes_have_the_option(command: click.Command) -> None:
    assert any("-D" in option.opts for option in command.params)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, ["line 1", "$width is undefined", "<default", "-D width=VALUE"]),
        ({"widht": "3"}, ["$width is undefined", "did you mean widht?"]),
        ({"width": "3", "shde": "1"}, ["-D shde", "it has shade, width, size", "did you mean shade?"]),
        ({"width": "three"}, ["width", "three", "an integer"]),
    ],
)
def test_mistakes_are_named_once_with_a_remedy(path: Path, given: dict[str, str], words: list[str]) -> None:
    with pytest.raises(SceneError) as error:
        load(path, parameters=given)
    (said,) = error.value.problems
    assert str(path) in said and all(word in said for word in words), said


def test_a_scene_without_parameters_says_so(path: Path) -> None:
    path.write_text('<scene version="3.0.0"/>')
    with pytest.raises(SceneError, match="-D shade: the scene has no such parameter; it has none; leave it out"):
        load(path, parameters={"shade": "1"})


@pytest.mark.parametrize("given", ["shade=1", {"shade": 1}, {1: "a"}, None])
def test_parameters_are_strings(path: Path, given: Any) -> None:
    with pytest.raises(UsageError, match="do not map names to strings|load.parameters: .* is not a dict"):
        load(path, parameters=given)


def test_they_are_for_mitsubas_scenes(tmp_path: Path) -> None:
    (tmp_path / "a.toml").write_text("[[sphere]]\n")
    with pytest.raises(UsageError, match="-D shade: parameters are for Mitsuba's scenes"):
        load(tmp_path / "a.toml", parameters={"shade": "1"})


@pytest.mark.parametrize("given", ["shade", "=1", ""])
def test_an_option_without_a_value_is_refused(path: Path, given: str) -> None:
    done = CliRunner().invoke(info, [str(path), "-D", given])
    assert done.exit_code == 2 and "write NAME=VALUE" in done.output
