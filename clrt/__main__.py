"""`python -m clrt`, and `clrt`, are the command line."""

import atexit
import os
import sys
from contextlib import suppress


def main() -> None:
    """Runs it; one that is interrupted before it has begun ends as quietly as later."""
    code: list[int] = []
    atexit.register(_end, code)     # before all others are, so it is called after them
    try:
        from .cli import main as run
        from .device import background

        background.ends_at_once = True
        run()
    except KeyboardInterrupt:
        sys.exit(130)
    except SystemExit as stop:
        if stop.code is None or isinstance(stop.code, int):
            code.append(stop.code or 0)
        raise


def _end(code: list[int]) -> None:
    """Ends the process where that is all that is left to do: Python takes its modules apart first, which takes a
    thirtieth of a short render, and some drivers crash as they are unloaded, when all work is done."""
    with suppress(OSError, ValueError, AttributeError):     # Python tells of output that is not there
        sys.stdout.flush()
        sys.stderr.flush()
        if code:
            os._exit(code[0])


if __name__ == "__main__":  # workers of a farm on this machine import it, too
    main()
