"""Rates measured on GPUs, from measured.toml."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from .variants import Program

KINDS = ("primary", "bounce", "shadow", "occluded")


@dataclass(frozen=True)
class QueryPoint:
    """Rays per second of one kind of rays through the bumpy sphere."""

    gpu: str
    layout: str
    subdivisions: int
    side: int
    kind: str
    rate: float

    @property
    def name(self) -> str:
        """Return what was measured."""
        return f"{self.kind}, {self.layout}, {12 * 4**self.subdivisions} triangles, {self.side}²"


@dataclass(frozen=True)
class ScenePoint:
    """Samples per second of a scene's image."""

    gpu: str
    scene: str
    variant: str
    layout: str
    size: int
    rate: float
    program: Program

    @property
    def name(self) -> str:
        """Return what was measured."""
        return f"{self.scene}, {self.variant}, {self.layout}"


@cache
def measured_queries() -> tuple[QueryPoint, ...]:
    """Return all measured rates of queries."""
    return tuple(
        QueryPoint(row["gpu"], row["layout"], row["subdivisions"], row["side"], kind, 1e9 * row[kind])
        for row in _rows("queries")
        for kind in KINDS
        if kind in row
    )


@cache
def measured_scenes() -> tuple[ScenePoint, ...]:
    """Return all measured rates of scenes."""
    return tuple(
        ScenePoint(
            row["gpu"],
            row["scene"],
            row["variant"],
            row["layout"],
            row["size"],
            1e6 * row["msamples"],
            Program(row["registers"], row["instructions"]),
        )
        for row in _rows("scenes")
    )


def _rows(table: str) -> list[dict[str, Any]]:
    text = files(__package__).joinpath("measured.toml").read_text(encoding="utf-8")
    return list(tomllib.loads(text)[table])
