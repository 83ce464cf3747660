"""Paths as readable text: a paragraph per sample, a few lines per vertex."""

from __future__ import annotations

from collections.abc import Iterator

from .vertices import BsdfSample, Emission, LightSample, Triple, Vertex


def path_lines(sample: int, value: Triple, vertices: list[Vertex]) -> Iterator[str]:
    """Yield the lines of a sample's path."""
    yield f"sample {sample}: {_numbers(value)}"
    for vertex in vertices:
        yield f"  {vertex.depth}  {_place(vertex)}"
        yield f"     throughput {_numbers(vertex.throughput)}"
        if vertex.emission:
            yield f"     emission: {_emission(vertex.emission)}"
        if vertex.light_sample:
            yield from (f"     {line}" for line in _light_sample(vertex.light_sample))
        if vertex.bsdf_sample:
            yield f"     BSDF sample: {_bsdf_sample(vertex.bsdf_sample)}"
        if vertex.end and vertex.object:
            yield f"     ends: {vertex.end}"


def _place(vertex: Vertex) -> str:
    if vertex.object is None or vertex.position is None or vertex.distance is None:
        return "escaped"
    triangle = "" if vertex.object.startswith("sphere") else f", triangle {vertex.triangle}"
    bent = (
        ""
        if vertex.shading_normal in (None, vertex.geometric_normal)
        else f", shading normal ({_direction(vertex.shading_normal)})"
    )
    side = "the front" if vertex.front else "behind"
    return (
        f"{vertex.object}{triangle}, material {vertex.material}, seen from {side}"
        f"\n     at ({_numbers(vertex.position)}), distance {vertex.distance:.4g}, normal "
        f"({_direction(vertex.geometric_normal)}){bent}"
    )


def _emission(emission: Emission) -> str:
    if emission.mis_weight is None:
        return f"none from {emission.source} in this direction"
    return (
        f"{emission.source}, radiance {_numbers(emission.radiance)}, MIS weight {emission.mis_weight:.4g}; "
        f"{_contribution(emission)}"
    )


def _light_sample(light: LightSample) -> Iterator[str]:
    yield (
        f"light sample: {light.light}, probability {light.probability:.4g}, direction "
        f"({_direction(light.direction)}), pdf {light.pdf:.4g}"
    )
    yield (
        f"  radiance {_numbers(light.radiance)}, BSDF {_numbers(light.bsdf)}, MIS weight {light.mis_weight:.4g}; "
        f"{light.outcome}{f' by {light.blocker}' if light.blocker else ''}; "
        f"{_contribution(light)}"
    )


def _contribution(part: Emission | LightSample) -> str:
    return f"contributes {_numbers(part.contribution)}{f', clamped by {part.clamp:.4g}' if part.clamp < 1 else ''}"


def _bsdf_sample(sample: BsdfSample) -> str:
    return (
        f"{'specular ' * sample.specular}direction ({_direction(sample.direction)}), pdf {sample.pdf:.4g}, "
        f"weight {_numbers(sample.weight)}"
    )


def _direction(values: Triple | None) -> str:
    """Return a unit vector without the digits that are due to rounding."""
    return " ".join(f"{round(value, 6) + 0.0:.4g}" for value in values or ())


def _numbers(values: Triple | None) -> str:
    return " ".join(f"{value:.4g}" for value in values or ())
