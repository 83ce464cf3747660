"""`python -m clrt` is the command line."""

from .cli import main

if __name__ == "__main__":  # workers of a farm on this machine import it, too
    main()
