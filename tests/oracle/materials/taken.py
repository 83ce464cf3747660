"""Energy that min(T(wo), T(wi)) takes from a lobe beyond 1 − T(wo), below layers of transmittance T.

That is ∫ lobe·max(T(wo) − T(wi), 0) dwi, by quadrature, in tables over the cosine and the
textured parameters of a material.
"""

from __future__ import annotations

from functools import cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from clrt.scene.materials.metallic_roughness import MetallicRoughness
from clrt.scene.materials.textures import Texture

from ..surface import Surface
from ..vectors import Doubles
from .albedo import bounces
from .fibres import Fibres, across
from .film import Film
from .layers import Layers

Nodes = tuple[float, ...]

#: Nodes of the cosine, and of textured roughnesses and strengths.
COSINES: Nodes = tuple(np.linspace(1e-3, 1, 41) ** 2)
ROUGHNESSES: Nodes = tuple(np.linspace(0.25, 1, 7))
THREADS: Nodes = tuple(np.geomspace(0.1, 1, 7))
STRENGTHS: Nodes = (0.0, 0.5, 1.0)


class Axis(NamedTuple):
    """Axis of a table: its nodes, and the value per row, (n,)."""

    nodes: Nodes
    values: Doubles


class Taken:
    """Energy taken by a material's clearcoat and sheen at hits."""

    def __init__(self, material: MetallicRoughness, at: Surface) -> None:
        base = _axis(material.roughness, at.number(material.roughness), ROUGHNESSES)
        film = _axis(material.clearcoat, at.number(material.clearcoat), STRENGTHS)
        smooth = _axis(material.clearcoat_roughness, at.number(material.clearcoat_roughness), ROUGHNESSES)
        fibres = _axis(material.sheen_color, at.color(material.sheen_color).max(axis=1), STRENGTHS)
        threads = _axis(material.sheen_roughness, at.number(material.sheen_roughness), THREADS)
        self._smith = material.smith
        self._gloss, self._sheen = [base, film, smooth, fibres, threads], [film, smooth, threads]

    def from_gloss(self, cosine: Doubles) -> tuple[Doubles, Doubles]:
        """Return what is taken from a single bounce's F0 and F90 parts, (n, 1) each, at cosines (n,)."""
        nodes, values = _with_cosines(self._gloss, cosine)
        found = _interpolated(_gloss(self._smith, *nodes), nodes, values)
        return found[:, :1], found[:, 1:]

    def from_fibres(self, cosine: Doubles) -> Doubles:
        """Return what the clearcoat takes from white sheen, (n, 1), at cosines (n,)."""
        nodes, values = _with_cosines(self._sheen, cosine)
        return _interpolated(_sheen(*nodes), nodes, values)


def _axis(parameter: Any, values: Doubles, nodes: Nodes) -> Axis:
    """Return the axis of a parameter: its single value, or these nodes if it is a texture."""
    return Axis(nodes if isinstance(parameter, Texture) else (float(values[0]),), values)


def _with_cosines(axes: list[Axis], cosine: Doubles) -> tuple[list[Nodes], list[Doubles]]:
    return [each.nodes for each in axes] + [COSINES], [each.values for each in axes] + [cosine]


def _interpolated(table: Doubles, axes: list[Nodes], values: list[Doubles]) -> Doubles:
    """Interpolate a table (..., c) linearly between its nodes, at values (n,) for each axis; return (n, c)."""
    places = [np.interp(value, nodes, np.arange(len(nodes))) for nodes, value in zip(axes, values)]
    firsts = [np.minimum(place.astype(int), max(len(nodes) - 2, 0)) for nodes, place in zip(axes, places)]
    total = np.zeros((len(values[0]), table.shape[-1]))
    for corner in product(*((0, 1) if len(nodes) > 1 else (0,) for nodes in axes)):
        shares = [abs(1 - step - (place - first)) for step, place, first in zip(corner, places, firsts)]
        total += np.prod(shares, axis=0)[:, None] * table[tuple(first + step for first, step in zip(firsts, corner))]
    return total


@cache
def _gloss(smith: str, *axes: Nodes) -> Doubles:
    """Return the table (..., 2) for gloss."""
    found = [
        _lost(cosine, *bounces(cosine, base**2, smith), _layers(film, smooth, fibres, threads))
        for base, film, smooth, fibres, threads, cosine in product(*axes)
    ]
    return np.reshape(found, (*map(len, axes), 2))


@cache
def _sheen(*axes: Nodes) -> Doubles:
    """Return the table (..., 1) for sheen."""
    found = [
        _lost(cosine, *across(cosine, threads), _layers(film, smooth, 0.0, 0.0))
        for film, smooth, threads, cosine in product(*axes)
    ]
    return np.reshape(found, (*map(len, axes), 1))


def _layers(film: float, smooth: float, fibres: float, threads: float) -> Layers:
    """Return layers at a single point."""
    return Layers(
        Film(np.array([film]), np.array([smooth])) if film else None,
        Fibres(np.full((1, 3), fibres), np.array([threads])) if fibres else None,
    )


def _lost(cosine: float, cos_i: Doubles, weights: Doubles, layers: Layers) -> Doubles:
    """Return the energy taken (c,) from a lobe that sends weights (m, c) to cosines (m,)."""
    return np.asarray(np.maximum(layers.left(np.array([cosine])) - layers.left(cos_i), 0) @ weights)
