"""Limits of numbers and text for the types of fields: `Annotated[float, Ge(0), Lt(90)]`.

The package annotated-types has the same, but takes longer to import than all materials of this project.
"""

from __future__ import annotations


class Limit:
    """Base class of the bounds. bound: the number to compare with."""

    def __init__(self, bound: float) -> None:
        self.bound = bound


class Ge(Limit):
    """Inclusive lower bound."""


class Gt(Limit):
    """Exclusive lower bound."""


class Le(Limit):
    """Inclusive upper bound."""


class Lt(Limit):
    """Exclusive upper bound."""


class Characters:
    """The characters that text may have. pattern: regular expression of valid text; names: of its characters."""

    def __init__(self, pattern: str, names: str) -> None:
        self.pattern, self.names = pattern, names
