"""Logging options `-q` and `-v`: the library writes to loggers named `clrt…`, the command line shows them on stderr."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, TypeVar

import click

F = TypeVar("F", bound=Callable[..., Any])


def verbose_option(command: F) -> F:
    """Add `-v`, which also shows informational messages, and `-vv`, which shows all messages."""
    return click.option(
        "-v",
        "--verbose",
        count=True,
        expose_value=False,
        callback=_show_more,
        help="Show informational messages; -vv shows debug messages, too.",
    )(command)


def silence() -> None:
    """Disable warnings, including those of libraries, until the command ends."""
    logging.disable(logging.WARNING)
    click.get_current_context().call_on_close(lambda: logging.disable(logging.NOTSET))


def _show_more(context: click.Context, parameter: click.Parameter, count: int) -> None:
    last = logging.lastResort  # looks up sys.stderr for each message, so it works with a bar
    if count and last is not None:
        level = logging.INFO if count == 1 else logging.DEBUG
        last.setLevel(level)
        logging.getLogger("clrt").setLevel(level)
