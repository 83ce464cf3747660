"""Path vertices as plain named values, in the scene's own frame, for printing and for JSON output."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .names import SceneNames
from .outcomes import outcomes
from .record import PathEnd
from .trace import PixelPaths

Triple = tuple[float, float, float]

ENDS = {
    PathEnd.ESCAPED: "escaped",
    PathEnd.DEPTH: "depth limit",
    PathEnd.ABSORBED: "absorbed",
    PathEnd.SIDE: "BSDF sample on the wrong side of the surface",
    PathEnd.ROULETTE: "Russian roulette",
}


@dataclass(frozen=True)
class Emission:
    """Emission that the path hit by BSDF sampling or from the camera. source: an object, or something infinitely far
    away; mis_weight: None if nothing is emitted towards the path; clamp: the factor by which a clamp scales the
    contribution, 1 without; contribution: to the sample's value."""

    source: str
    radiance: Triple
    mis_weight: float | None
    clamp: float
    contribution: Triple


@dataclass(frozen=True)
class LightSample:
    """Light sample: a chosen light, and a direction to it.

    probability: of choosing this light; pdf: of the direction per solid angle, including that probability (for a point,
    spot or directional light without a size it is just that); radiance: unoccluded incident radiance, or the irradiance
    of such a light; bsdf: f·|cos|; outcome: see `Outcome`; blocker: the object that casts the shadow; unshadowed: the
    contribution without shadows or clamps; clamp, contribution: as in `Emission`.
    """

    light: str
    probability: float
    direction: Triple
    pdf: float
    radiance: Triple
    bsdf: Triple
    mis_weight: float
    outcome: str
    blocker: str | None
    unshadowed: Triple
    clamp: float
    contribution: Triple


@dataclass(frozen=True)
class BsdfSample:
    """Direction sampled from the BSDF. pdf: per solid angle; weight: f·|cos|/pdf; specular: whether it is from a delta
    distribution, which light samples never hit."""

    direction: Triple
    pdf: float
    weight: Triple
    specular: bool


@dataclass(frozen=True)
class Vertex:
    """Vertex of a path. object … shading_normal: None if the path escaped. front: whether the front side is seen.
    throughput: radiance at the camera over radiance that arrives here. end: why the path ends here, or None."""

    depth: int
    object: str | None
    object_number: int | None
    triangle: int | None
    material: str | None
    front: bool | None
    position: Triple | None
    distance: float | None
    geometric_normal: Triple | None
    shading_normal: Triple | None
    throughput: Triple
    emission: Emission | None
    light_sample: LightSample | None
    bsdf_sample: BsdfSample | None
    end: str | None


def vertices(paths: PixelPaths, names: SceneNames, sample: int) -> Iterator[Vertex]:
    """Yield the vertices of a sample's path."""
    start = paths.starts[sample]
    rows = paths.rows[start : start + paths.lengths[sample]]
    frame, (objects, triangles) = paths.compiled.frame, names.hits(rows["primitive"], rows["instance"])
    blockers, _ = names.hits(rows["blocker"], rows["blocker_instance"])
    for i, (row, outcome) in enumerate(zip(rows, outcomes(rows))):
        hit = row["primitive"] >= 0
        number, triangle = (int(objects[i]), int(triangles[i])) if hit else (None, None)
        yield Vertex(
            i + 1,
            None if number is None else names.object(number),
            number,
            triangle,
            None if number is None else names.material(number),
            bool(row["front"]) if hit else None,
            _triple(row["position"].astype(np.float64) / frame.unit + frame.center) if hit else None,
            float(row["distance"]) / frame.unit if hit else None,
            _triple(row["geometric_normal"]) if hit else None,
            _triple(row["shading_normal"]) if hit else None,
            _triple(row["throughput"]),
            _emission(row, names, number),
            _light_sample(row, names, outcome, int(blockers[i])) if row["light"] >= 0 else None,
            _bsdf_sample(row),
            ENDS.get(PathEnd(row["end"])),
        )


def mis_weight(row: NDArray[Any]) -> float | None:
    """Return the MIS weight of the emission found at a vertex; None if there is none. For several suns and a sky
    together it is the weighted over the unweighted sum."""
    whole = row["throughput"].astype(np.float64) * row["radiance"]
    channel = int(np.argmax(whole))
    return float(row["emission"][channel] / whole[channel]) if whole[channel] > 0 else None


def _emission(row: NDArray[Any], names: SceneNames, number: int | None) -> Emission | None:
    source = names.infinite if number is None else names.object(number) if row["emitter"] >= 0 else ""
    return (
        Emission(
            source,
            _triple(row["radiance"]),
            mis_weight(row),
            float(row["emission_clamp"]),
            _triple(row["emission"] * row["emission_clamp"]),
        )
        if source
        else None
    )


def _light_sample(row: NDArray[Any], names: SceneNames, outcome: str, blocker: int) -> LightSample:
    return LightSample(
        names.light(int(row["light"])),
        float(row["light_probability"]),
        _triple(row["light_direction"]),
        float(row["light_pdf"]),
        _triple(row["light_radiance"]),
        _triple(row["light_bsdf"]),
        float(row["light_weight"]),
        str(outcome),
        names.object(blocker) if blocker >= 0 else None,
        _triple(row["unshadowed"]),
        float(row["direct_clamp"]),
        _triple(row["direct"] * row["direct_clamp"]),
    )


def _bsdf_sample(row: NDArray[Any]) -> BsdfSample | None:
    if not row["direction"].any():
        return None
    return BsdfSample(_triple(row["direction"]), float(row["pdf"]), _triple(row["weight"]), bool(row["specular"]))


def _triple(values: NDArray[Any]) -> Triple:
    x, y, z = (float(value) for value in values)
    return x, y, z
