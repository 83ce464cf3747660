"""The generated reference: every public name and command is in it, and has a docstring that reads well there."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from collections.abc import Iterator
from html import unescape
from pathlib import Path

import click
import pytest

import clrt
from clrt.cli import commands

HOUSE = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the pages that docs/make_reference.py writes."""
    folder = tmp_path_factory.mktemp("reference")
    command = [sys.executable, str(HOUSE / "docs" / "make_reference.py"), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0 and not done.stderr, done.stderr
    return folder


def words(text: str) -> str:
    """Return the words of HTML or Markdown, without marks of emphasis."""
    return " ".join(re.sub(r"[`*_]", "", unescape(re.sub("<[^>]*>", "", text))).split())


def members() -> Iterator[tuple[str, object]]:
    """Yield every public name, and the methods and properties of public classes but materials and lights."""
    for name in clrt.__all__:
        value = getattr(clrt, name)
        yield name, value
        for key in dir(value) if isinstance(value, type) and not hasattr(value, "kernel") else ():
            attribute = inspect.getattr_static(value, key)
            if not key.startswith("_") and (inspect.isfunction(attribute) or isinstance(attribute, property)):
                yield f"{name}.{key}", attribute


def summary(docstring: str) -> str:
    """Return the first line of a docstring if a sentence ends there, otherwise nothing."""
    first = docstring.partition("\n")[0]
    return first if re.search(r"^[A-Z(].*\.( |$)", first) else ""


def test_public_names_have_a_docstring_that_starts_with_a_sentence() -> None:
    assert [name for name, value in members() if not summary(inspect.getdoc(value) or "")] == []


@pytest.mark.parametrize("docstring", ["", "Return the image", "return the image.", "Return the image, as\nread."])
def test_docstrings_without_a_sentence_are_found(docstring: str) -> None:
    assert not summary(docstring)


def test_every_public_name_is_in_the_reference(folder: Path) -> None:
    page = "".join((folder / name).read_text(encoding="utf-8") for name in ("clrt.html", "clrt/trimesh.html"))
    text = words(page)
    for name, value in members():
        assert f'id="{name}"' in page or name == "trimesh", name
        assert words(summary(inspect.getdoc(value) or "")) in text, name


def leaves(command: click.Command, path: str) -> Iterator[tuple[str, click.Command]]:
    """Yield a command and all below it, each with its words."""
    yield path, command
    if isinstance(command, click.Group):
        for name in command.list_commands(click.Context(command)):
            each = command.get_command(click.Context(command), name)
            assert each is not None
            yield from leaves(each, f"{path} {name}")


def test_every_command_and_option_is_in_the_reference(folder: Path) -> None:
    page = unescape((folder / "command_line.html").read_text(encoding="utf-8"))
    for path, command in leaves(commands, "clrt"):
        section = page.partition(f'<h{len(path.split()) + 1} id="{path.replace(" ", "-")}">')[2].partition("<h")[0]
        options = [
            option
            for parameter in command.params
            if not getattr(parameter, "hidden", False)
            for option in parameter.opts
            if option.startswith("-")
        ]
        missing = [option for option in options if not re.search(rf"(?<![\w-]){option}(?![\w-])", section)]
        assert section and not missing, (path, missing)


def test_annotations_are_as_written(folder: Path) -> None:
    """Not as what their names stand for, such as numpy's dozen types of ArrayLike."""
    text = words((folder / "clrt.html").read_text(encoding="utf-8"))
    assert "onphase: Callable[[str], None] | None" in text  # one of Renderer's keywords, which a decorator adds
    assert "origins: ArrayLike" in text and "fovdegrees: Annotated[float, Gt(0), Lt(180)]" in text
