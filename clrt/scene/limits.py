"""What a number may be, in the types of fields: `Annotated[float, Ge(0), Lt(90)]`.

The package annotated-types has the same, but takes longer to load than all materials of this project.
"""

from __future__ import annotations


class Limit:
    """bound: the number that it goes by."""

    def __init__(self, bound: float) -> None:
        self.bound = bound


class Ge(Limit):
    """At least."""


class Gt(Limit):
    """More than."""


class Le(Limit):
    """At most."""


class Lt(Limit):
    """Less than."""
