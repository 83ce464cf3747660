"""Generate the reference of the Python API and of the command line: python docs/make_reference.py [FOLDER]

From the docstrings of clrt's public names and the help of its commands, as HTML by pdoc (pip install '.[docs]'), in
FOLDER, by default docs/reference. Open its index.html.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import click
import pdoc

import clrt
from clrt.cli import commands

FOLDER = Path(__file__).parent / "reference"
#: Columns of a command's help.
WIDTH = 110


class Written(str):
    """An annotation as the source has it, with public names as links."""

    def __new__(cls, annotation: object) -> Written:
        names = "|".join(sorted(clrt.__all__, key=len, reverse=True))
        text = annotation if isinstance(annotation, str) else inspect.formatannotation(annotation)
        return super().__new__(cls, re.sub(rf"(?<![\w.\"'])({names})(?![\w\"'])", r"clrt.\1", text))

    __repr__ = str.__str__


def describe_function(page: pdoc.doc.Function, function: Callable[..., object]) -> None:
    """Show what help() shows of a function: annotations as written, such as ArrayLike, and what decorators add."""
    written = inspect.signature(function)
    parameters = [
        parameter
        if parameter.annotation is parameter.empty
        else parameter.replace(annotation=Written(parameter.annotation))
        for parameter in written.parameters.values()
    ]
    returned = inspect.Signature.empty if page.name == "__init__" else Written(written.return_annotation)
    vars(page)["signature"] = page.signature.replace(parameters=parameters, return_annotation=returned)
    if page.name != "__init__":  # whose class has the docstring
        vars(page)["docstring"] = inspect.getdoc(function) or ""
    vars(page)["decorators"] = [each for each in page.decorators if each in ("@classmethod", "@staticmethod")]


def describe_class(page: pdoc.doc.Class) -> None:
    """Include what base classes that are not public say and do, and leave out what the signature shows.

    That is the fields of a dataclass. Fields are all that users need of materials and lights, which name their kernel:
    their methods serve the renderer.
    """
    bases = [
        base
        for base in page.obj.__mro__[1:]
        if base.__module__.startswith("clrt.") and base.__name__ not in clrt.__all__
    ]
    fields = {field.name for field in dataclasses.fields(page.obj)} if dataclasses.is_dataclass(page.obj) else set()
    members = [
        member
        for name, member in page.members.items()
        if member.taken_from[0].startswith("clrt")
        and name not in fields
        and (name == "__init__" or not hasattr(page.obj, "kernel"))
    ]
    for member in members:
        attribute = inspect.getattr_static(page.obj, member.name, None)
        if isinstance(member, pdoc.doc.Function):
            describe_function(member, getattr(page.obj, member.name))
        elif isinstance(member, pdoc.doc.Variable) and isinstance(attribute, property):
            vars(member)["annotation_str"] = f": {Written(attribute.fget.__annotations__['return'])}"
    vars(page)["own_members"] = members
    vars(page)["decorators"] = [each for each in page.decorators if not each.startswith("@listed")]
    vars(page)["docstring"] = "\n\n".join([page.docstring, *(inspect.cleandoc(base.__doc__ or "") for base in bases)])


def api(module: ModuleType) -> pdoc.doc.Module:
    """Return the documentation of a module's public names."""
    for name in getattr(module, "__all__", ()):
        getattr(module, name)  # clrt's are imported on first use; pdoc looks only at what is there
    page = pdoc.doc.Module(module)
    for each in page.members.values():
        if isinstance(each, pdoc.doc.Class):
            describe_class(each)
        elif isinstance(each, pdoc.doc.Function):
            describe_function(each, getattr(module, each.name))
    return page


def helps(command: click.Command, path: str, parent: click.Context | None = None) -> Iterator[str]:
    """Yield a section for a command and each command below it."""
    with click.Context(
        command,
        info_name=path.split()[-1],
        parent=parent,
        max_content_width=WIDTH,
        terminal_width=WIDTH,
        **command.context_settings,
    ) as context:
        yield f"{'#' * len(path.split())}# {path}\n\n```text\n{command.get_help(context)}\n```\n"
        if isinstance(command, click.Group):
            for name in command.list_commands(context):
                each = command.get_command(context, name)
                assert each is not None
                yield from helps(each, f"{path} {name}", context)


def command_line() -> pdoc.doc.Module:
    """Return the documentation of the command line, as that of a module without names."""
    text = "The help of each command, as printed by `--help`.\n\n" + "\n".join(helps(commands, "clrt"))
    return pdoc.doc.Module(ModuleType("command_line", text))


def main(folder: Path = FOLDER) -> None:
    pdoc.render.configure(show_source=False, footer_text=f"clrt {clrt.__version__}")
    with warnings.catch_warnings():  # pdoc tries to evaluate annotations that base classes have in other modules
        warnings.filterwarnings("ignore", "Error parsing type annotation")
        pages = {page.fullname: page for page in (api(clrt), api(clrt.trimesh), command_line())}
    texts = {f"{name.replace('.', '/')}.html": pdoc.render.html_module(page, pages) for name, page in pages.items()}
    texts |= {"index.html": pdoc.render.html_index(pages), "search.js": pdoc.render.search_index(pages)}
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    print(folder / "index.html")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
