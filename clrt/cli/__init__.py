"""Command line interface: one file per command; this one dispatches to the commands and reports errors."""

from __future__ import annotations

import gc
import os
import sys
import time
import traceback
from importlib import import_module
from typing import NoReturn

import click

from ..errors import ClrtError, DeviceError, KernelError, OutputError
from .command_group import CommandGroup
from .streams import open_missing, patient_stdout, show_names, stdout_problem, tell

STARTED = time.perf_counter()
#: Context object of commands that run in a process of their own.
PROGRAM = "clrt"
#: Number of new objects that triggers garbage collection.
OBJECTS = 100_000
COMMANDS = (
    "render",
    "view",
    "bake",
    "relight",
    "info",
    "debug",
    "convert",
    "compare",
    "devices",
    "bench",
    "cache",
    "doctor",
)


class _Commands(CommandGroup):
    """Commands by name, each imported on first use."""

    def list_commands(self, context: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        command: click.Command = import_module(f".{name}", __name__).command
        return command


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="clrt")
def commands() -> None:
    """Path tracing on any OpenCL device, with an error estimate for every image."""


def main(arguments: list[str] | None = None) -> None:
    """Run a command and exit: 0 done, 2 usage, 3 scene, 4 device, 5 kernel, 6 output, 130 interrupted."""
    # When loaded, numpy's OpenBLAS starts a thread per core, which spin for a while. No command needs them.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # By default Python collects garbage every 700 new objects, a tenth of the time it takes to import all modules.
    gc.set_threshold(OBJECTS)
    open_missing()
    show_names()
    stdout = patient_stdout()
    code = _run(arguments)
    if problem := stdout_problem(stdout):
        tell(f"error: {problem}")
        code = code or OutputError.exit_code
    _leave(code)


def _run(arguments: list[str] | None) -> str | int | None:
    """Run a command, report its errors and return the exit code."""
    try:
        commands.main(arguments, prog_name="clrt", standalone_mode=False, obj=PROGRAM)
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.ClickException as error:
        error.show(sys.stderr)
        return 2
    except ClrtError as error:
        if isinstance(error, DeviceError | KernelError):
            _keep(str(error))
        tell("\n".join(f"error: {line}" for line in getattr(error, "problems", [str(error)])))
        return error.exit_code
    except (KeyboardInterrupt, click.Abort):
        tell("interrupted")
        return 130
    except SystemExit as stop:
        return stop.code
    except Exception:
        _keep(traceback.format_exc())
        raise
    return 0


def _keep(error: str) -> None:
    """Store the error for `clrt doctor`."""
    from ..device.cache_files import keep_log

    keep_log("error", error)


def _leave(code: str | int | None) -> NoReturn:
    """Exit; immediately if a device has hung, as its driver might block the regular exit forever."""
    pulse = sys.modules.get("clrt.device.launches.hang_watchdog")
    if pulse is not None and pulse.has_hung() and isinstance(code, int):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)
