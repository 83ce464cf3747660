"""`python -m clrt`, and `clrt`, are the command line."""

import sys


def main() -> None:
    """Runs it; one that is interrupted before it has begun ends as quietly as later."""
    try:
        from .cli import main as run

        run()
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":  # workers of a farm on this machine import it, too
    main()
