"""Bounds of numbers for the types of fields: `Annotated[float, Ge(0), Lt(90)]`.

The package annotated-types has the same, but takes longer to import than all materials of this project.
"""

from __future__ import annotations


class Limit:
    """Base class of the limits. bound: the number to compare with."""

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
