"""`python -m clrt` is the command line."""

from .cli import main

main()
