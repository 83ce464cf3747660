"""Strengths of lights that have a given power."""

from __future__ import annotations

from .entities import Entity
from .named_spectra import Triple


def powered(strength: Triple, entity: Entity, total: float) -> Triple:
    """Return the strength of a light of a `power`, if it has one, by the power of one of strength 1."""
    power = entity.number("power", -1.0)
    return times(strength, power / total) if power > 0 and total > 0 else strength


def times(color: Triple, factor: float) -> Triple:
    """Return a color times a number."""
    red, green, blue = (factor * part for part in color)
    return red, green, blue
