"""What `-q` and `-v` show of the log: the library writes to loggers named `clrt…`, and the command line to stderr."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, TypeVar

import click

F = TypeVar("F", bound=Callable[..., Any])


def verbose_option(command: F) -> F:
    """`-v`: what is chosen and done, too; `-vv`: all that is logged."""
    return click.option("-v", "--verbose", count=True, expose_value=False, callback=_show_more,
                        help="Tell more; -vv tells everything.")(command)


def silence() -> None:
    """No warnings, the libraries' either, as long as the command runs."""
    logging.disable(logging.WARNING)
    click.get_current_context().call_on_close(lambda: logging.disable(logging.NOTSET))


def _show_more(context: click.Context, parameter: click.Parameter, count: int) -> None:
    last = logging.lastResort    # writes to standard error, whatever that is at the time, so beside a bar
    if count and last is not None:
        level = logging.INFO if count == 1 else logging.DEBUG
        last.setLevel(level)
        logging.getLogger("clrt").setLevel(level)
