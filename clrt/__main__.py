"""Entry point of `python -m clrt` and `clrt`, the command line."""

import atexit
import os
import sys
from contextlib import suppress


def main() -> None:
    """Run the command line; an interrupt during startup ends it as quietly as a later one."""
    code: list[int] = []
    atexit.register(_end, code)  # registered before all others, so called after them
    try:
        from .cli import main as run
        from .device.programs import background_compile

        background_compile.ends_at_once = True
        run()
    except KeyboardInterrupt:
        sys.exit(130)
    except SystemExit as stop:
        if stop.code is None or isinstance(stop.code, int):
            code.append(stop.code or 0)
        raise


def _end(code: list[int]) -> None:
    """Exit the process at once: interpreter shutdown takes a thirtieth of a short render, and some drivers crash when
    they are unloaded, after all work is done."""
    with suppress(OSError, ValueError, AttributeError):  # standard output may be missing or closed
        sys.stdout.flush()
        sys.stderr.flush()
        if code:
            os._exit(code[0])


if __name__ == "__main__":  # workers on this machine import this module, too
    main()
