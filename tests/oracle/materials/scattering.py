"""Interface of all materials, and sampling of directions.

Local frame: wo and wi are unit and point away from the surface, +z is its normal on the side of wo.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import NamedTuple, Protocol

import numpy as np

from ..vectors import Doubles, dot, unit


class Sample(NamedTuple):
    """wi (n, 3), and f·|cos wi| over its density, (n, 3), for radiance: includes its scaling by refraction."""

    wi: Doubles
    weight: Doubles


class Scattering(Protocol):
    """A material at ray hits."""

    #: Absorption per length of the medium that light enters, if it does, (n, 3).
    absorption_beyond: Doubles | None = None

    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles:
        """Return f·|cos wi| (n, 3), 0 for specular directions."""

    def sample(self, wo: Doubles, rng: np.random.Generator) -> Sample:
        """Sample a direction for each row."""


class Strategy(Protocol):
    """Way to sample directions, with its density per solid angle."""

    def draw(self, wo: Doubles, rng: np.random.Generator) -> Doubles: ...
    def density(self, wo: Doubles, wi: Doubles) -> Doubles: ...


class Mixed(Scattering):
    """A material whose directions are sampled by one of its strategies, all with equal probability."""

    strategies: list[Strategy]

    @abstractmethod
    def evaluate(self, wo: Doubles, wi: Doubles) -> Doubles: ...

    def sample(self, wo: Doubles, rng: np.random.Generator) -> Sample:
        choice = rng.integers(len(self.strategies), size=len(wo))
        drawn = np.array([each.draw(wo, rng) for each in self.strategies])
        wi = drawn[choice, np.arange(len(wo))]
        density = np.mean([each.density(wo, wi) for each in self.strategies], axis=0)
        value = self.evaluate(wo, wi)
        return Sample(wi, np.divide(value, density[:, None], out=np.zeros_like(value), where=density[:, None] > 0))


class Cosine:
    """Cosine-weighted sampling around the normal."""

    def draw(self, wo: Doubles, rng: np.random.Generator) -> Doubles:
        return power_directions(1.0, rng.random((len(wo), 2)))

    def density(self, wo: Doubles, wi: Doubles) -> Doubles:
        return np.maximum(wi[:, 2], 0) / np.pi


class Uniform:
    """Uniform sampling of the hemisphere."""

    def draw(self, wo: Doubles, rng: np.random.Generator) -> Doubles:
        return power_directions(0.0, rng.random((len(wo), 2)))

    def density(self, wo: Doubles, wi: Doubles) -> Doubles:
        return np.where(wi[:, 2] > 0, 0.5 / np.pi, 0.0)


class Through:
    """Another strategy, mirrored to the other side of the surface."""

    def __init__(self, strategy: Strategy) -> None:
        self._strategy = strategy

    def draw(self, wo: Doubles, rng: np.random.Generator) -> Doubles:
        return mirrored_below(self._strategy.draw(wo, rng))

    def density(self, wo: Doubles, wi: Doubles) -> Doubles:
        return self._strategy.density(wo, mirrored_below(wi))


def mirrored_below(w: Doubles) -> Doubles:
    """Mirror to the other side of the surface."""
    return w * [1.0, 1.0, -1.0]


def reflected(wo: Doubles, h: Doubles) -> Doubles:
    """Return the mirror image of wo about h."""
    return 2 * dot(wo, h)[:, None] * h - wo


def halfway(wo: Doubles, wi: Doubles) -> Doubles:
    """Return the unit half vector."""
    return unit(wo + wi)


def power_directions(n: float | Doubles, u: Doubles) -> Doubles:
    """Return directions around +z with a density of (n + 1)/2π·cosⁿ; u (k, 2) in [0, 1)."""
    z = u[:, 0] ** (1 / (n + 1))
    r, phi = np.sqrt(1 - z * z), 2 * np.pi * u[:, 1]
    return np.column_stack([r * np.cos(phi), r * np.sin(phi), z])
