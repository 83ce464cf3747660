"""A clearcoat over sheen over a surface, and their transmittance T, the product of both layers'."""

from __future__ import annotations

import numpy as np

from clrt.scene.materials.metallic_roughness import MetallicRoughness

from ..surface import Surface
from ..vectors import Doubles
from .fibres import Fibres
from .film import Film
from .scattering import Strategy, Uniform


class Layers:
    """A clearcoat, sheen, both, or neither."""

    def __init__(self, film: Film | None, fibres: Fibres | None) -> None:
        self._film, self.fibres = film, fibres
        self.strategies: list[Strategy] = [*([film.strategy] if film else []), *([Uniform()] if fibres else [])]

    def __bool__(self) -> bool:
        return bool(self._film or self.fibres)

    def film_left(self, cosine: Doubles) -> Doubles:
        """Return the clearcoat's transmittance (n,) at cosines (n,)."""
        return self._film.left(cosine) if self._film else np.ones_like(cosine)

    def left(self, cosine: Doubles) -> Doubles:
        """Return T (n,) at cosines (n,)."""
        return self.film_left(cosine) * (self.fibres.left(cosine) if self.fibres else 1.0)

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        """Return f·cos wi, (n, 3)."""
        value = np.zeros_like(wo)
        if self.fibres:
            value += np.minimum(*(self.film_left(w[:, 2]) for w in (wo, wi)))[:, None] * self.fibres.evaluate(wo, wi)
        return value + self._film.evaluate(wo, wi) if self._film else value


def layers_of(material: MetallicRoughness, at: Surface) -> Layers:
    """Return the layers of a material at hits."""
    has_film, has_fibres = material.clearcoat != 0, material.sheen_color != (0, 0, 0)
    return Layers(
        Film(at.number(material.clearcoat), at.number(material.clearcoat_roughness)) if has_film else None,
        Fibres(at.color(material.sheen_color), at.number(material.sheen_roughness)) if has_fibres else None,
    )
