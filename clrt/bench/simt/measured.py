"""Rates measured on GPUs, from measured.toml."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from .variants import Program

KINDS = ("primary", "bounce", "shadow", "occluded")
#: Samples in the times of stages.
STAGE_SAMPLES = 1 << 23


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
    """Samples per second of a scene's image, or of one stage of its queues."""

    gpu: str
    scene: str
    variant: str
    layout: str
    size: int
    rate: float
    stage: str | None = None

    @property
    def name(self) -> str:
        """Return what was measured."""
        return f"{self.scene}, {self.layout}, {self.variant}" + (f": {self.stage}" if self.stage else "")


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
    """Return all measured rates of scenes, and of the stages of their queues."""
    whole = [
        ScenePoint(row["gpu"], row["scene"], row["variant"], row["layout"], row["size"], 1e6 * row["msamples"])
        for row in _rows("scenes")
    ]
    stages = [
        ScenePoint(
            row["gpu"], row["scene"], "queues", row["layout"], row["size"], STAGE_SAMPLES / row[stage] * 1e3, stage
        )
        for row in _rows("stages")
        for stage in ("extend", "shade", "connect")
    ]
    return (*whole, *stages)


@cache
def measured_programs() -> dict[str, Program]:
    """Return the programs of scenes by name."""
    return {row["scene"]: Program(row["registers"], row["instructions"], row["shade"]) for row in _rows("programs")}


def _rows(table: str) -> list[dict[str, Any]]:
    text = files(__package__).joinpath("measured.toml").read_text(encoding="utf-8")
    return list(tomllib.loads(text)[table])
