"""Files that an experiment writes: its results as JSON, plots and images."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from functools import wraps
from pathlib import Path
from typing import Any

import click

from ..errors import OutputError, UsageError
from .fallback import kept_elsewhere

#: Parameters that name output files, with their options; parameters that name folders for images.
FILES = {"json_file": "--json", "plot": "--plot", "output": "--output"}
FOLDERS = ("pictures", "keep")


def figures_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add --json and --force to an experiment. Its output files are checked before it starts, as in `clrt render`, and
    its folders are created."""

    @wraps(command)
    def checked(force: bool, **given: Any) -> None:
        check_files(given, force)
        command(**given)

    for option in (
        click.option("--force", is_flag=True, help="Replace files that are read-only."),
        click.option(
            "--json",
            "json_file",
            type=click.Path(path_type=Path),
            metavar="FILE",
            help="Write the results to this file.",
        ),
    ):
        checked = option(checked)
    return checked


def write_figures(path: Path | None, figures: Mapping[str, Any]) -> None:
    """Write the results if a file was named, and print its name.

    Raises OutputError if that fails, with the fallback location if the results were written elsewhere.
    """
    if path is None:
        return
    from ..output.report import write_report

    try:
        write_report(path, figures)
    except OutputError as error:
        raise kept_elsewhere(error, path, lambda other: write_report(other, figures)) from error
    click.echo(str(path))


def check_files(given: Mapping[str, Any], force: bool) -> None:
    from ..output.atomic_files import check_target, check_unprotected, make_folder
    from ..output.error_plots import check_plot

    taken = {
        os.path.realpath(path): "an input"
        for name, value in given.items()
        if name not in {*FILES, *FOLDERS}
        for path in _paths(value)
    }
    for name, option in FILES.items():
        for path in _paths(given.get(name)):
            if before := taken.get(real := os.path.realpath(path)):
                raise UsageError(
                    f"{path}: is both {before} and {option}, one of which would be lost; choose another file"
                )
            taken[real] = option
            (check_plot if name == "plot" else check_target)(path)
            check_unprotected(path, force)
    for name in FOLDERS:
        for path in _paths(given.get(name)):
            make_folder(path)


def _paths(value: Any) -> Iterator[Path]:
    """Yield the paths in an option's value."""
    yield from (each for each in (value if isinstance(value, tuple) else (value,)) if isinstance(each, Path))
