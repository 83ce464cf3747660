"""Reference radiance of a plastic floor in float64, by Monte Carlo integration of the published model.

    f = F·D·G/(4·cos wi·cos wo) + (1 − E(wi))·(1 − E(wo))/(π·(1 − mean E))

for a white base: GGX's D (Walter et al. 2007, eq. 33), the height-correlated G (Heitz 2014, eq. 99), Schlick's F
(1994), and the coupling of Kelemen and Szirmay-Kalos (2001) with the directional albedo E of the specular lobe. These
are clrt's; MODELS has two more, to locate the differences of other renderers. No code is shared with the kernels.
y is up.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...scene.lights import DirectionalLight, Light, PointLight
from ...scene.materials.material_types import Diffuse, MetallicRoughness
from ...scene.materials.textures import untextured
from ...scene.model import Camera, Environment, Mesh, Scene

Doubles = NDArray[np.float64]
Bsdf = Callable[[Doubles, Doubles], Doubles]

#: Directions per batch, and the number of batches.
BATCH, BATCHES = 1 << 18, 8
#: Nodes in √cos at which E is integrated, and nodes in each dimension of its integral over directions.
NODES, DIRECTIONS = 96, 64


class Estimate(NamedTuple):
    """Mean and its standard error."""

    mean: float
    error: float


class Model(NamedTuple):
    """Model options. exact: F by Fresnel's equations; by_view: scale the base by 1 − E(wo) only (not reciprocal)."""

    exact: bool = False
    by_view: bool = False


#: clrt's model; the same with Fresnel's equations; and with the layering of Cycles' Principled BSDF.
MODELS = {"model": Model(), "Fresnel": Model(exact=True), "by view": Model(exact=True, by_view=True)}


class Plastic:
    """White plastic with an index of refraction `IOR`."""

    IOR = 1.5

    def __init__(self, roughness: float, model: Model = MODELS["model"]) -> None:
        self.alpha, self._model = roughness**2, model
        x, weights = np.polynomial.legendre.leggauss(NODES)
        self._roots = (x + 1) / 2
        self._albedos = np.array([self._albedo(root**2) for root in self._roots])
        self._kept = 1 - float(np.sum(2 * weights * self._roots**3 * self._albedos))  # mean E = ∫ 2c·E dc, c = root²

    def __call__(self, wo: Doubles, wi: Doubles) -> Doubles:
        """Evaluate f, (n,)."""
        h = _unit(wo + wi)
        fresnel = self._fresnel(np.sum(wo * h, axis=1))
        gloss = fresnel * self._distribution(h[:, 1]) * self._shadowing(wo[:, 1], wi[:, 1]) / (4 * wo[:, 1] * wi[:, 1])
        below = 1.0 if self._model.by_view else (1 - self.albedo(wi[:, 1])) / self._kept
        return np.asarray(gloss + (1 - self.albedo(wo[:, 1])) * below / np.pi)

    def albedo(self, cosine: Doubles) -> Doubles:
        """Return E, the directional albedo of the specular lobe."""
        return np.asarray(np.interp(np.sqrt(cosine), self._roots, self._albedos))

    def draw(self, wo: Doubles, u: Doubles) -> Doubles:
        """Sample (n, 3) directions reflected at visible normals, from numbers (n, 2) (Heitz 2018, listing 1)."""
        stretch = np.array([self.alpha, 1.0, self.alpha])
        v = _unit(wo * stretch)
        across = np.hypot(v[:, 0], v[:, 2])
        safe = np.where(across > 0, across, 1)
        t1 = np.column_stack([np.where(across > 0, v[:, 2] / safe, 1), np.zeros(len(v)), -v[:, 0] / safe])
        r, phi, s = np.sqrt(u[:, 0]), 2 * np.pi * u[:, 1], (1 + v[:, 1]) / 2
        x = r * np.cos(phi)
        y = (1 - s) * np.sqrt(np.maximum(1 - x * x, 0)) + s * r * np.sin(phi)
        height = np.sqrt(np.maximum(1 - x * x - y * y, 0))
        h = _unit((x[:, None] * t1 + y[:, None] * np.cross(v, t1) + height[:, None] * v) * stretch)
        return np.asarray(2 * np.sum(wo * h, axis=1)[:, None] * h - wo)

    def density(self, wo: Doubles, wi: Doubles) -> Doubles:
        """Return the pdf of `draw` (Heitz 2018, eq. 3)."""
        h = _unit(wo + wi)
        return np.asarray(self._distribution(h[:, 1]) / (1 + self._lambda(wo[:, 1])) / (4 * wo[:, 1]))

    def _albedo(self, cosine: float) -> float:
        """Integrate over visible normals; their first number is sin² of an angle in which the integrand is smooth."""
        x, weights = np.polynomial.legendre.leggauss(DIRECTIONS)
        angle, turn = np.meshgrid((x + 1) * np.pi / 4, (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS, indexing="ij")
        share = (np.sin(2 * angle) * weights[:, None] * np.pi / 4 / DIRECTIONS).ravel()
        wo = np.tile([np.sqrt(1 - cosine**2), cosine, 0.0], (share.size, 1))
        wi = self.draw(wo, np.column_stack([np.sin(angle).ravel() ** 2, turn.ravel()]))
        up = wi[:, 1] > 0
        seen = self._shadowing(wo[:, 1], np.where(up, wi[:, 1], 1)) * (1 + self._lambda(wo[:, 1]))  # G2/G1
        return float(np.sum((share * seen * self._fresnel(np.sum(wo * _unit(wo + wi), axis=1)))[up]))

    def _fresnel(self, cosine: Doubles) -> Doubles:
        if not self._model.exact:
            f0 = ((self.IOR - 1) / (self.IOR + 1)) ** 2
            return f0 + (1 - f0) * np.maximum(1 - cosine, 0) ** 5
        refracted = np.sqrt(1 - (1 - cosine**2) / self.IOR**2)
        across = (cosine - self.IOR * refracted) / (cosine + self.IOR * refracted)
        along = (self.IOR * cosine - refracted) / (self.IOR * cosine + refracted)
        return np.asarray((across**2 + along**2) / 2)

    def _distribution(self, cosine: Doubles) -> Doubles:
        return np.asarray(self.alpha**2 / (np.pi * (1 - cosine**2 * (1 - self.alpha**2)) ** 2))

    def _lambda(self, cosine: Doubles) -> Doubles:
        return np.asarray((np.sqrt(1 + self.alpha**2 * (1 / cosine**2 - 1)) - 1) / 2)

    def _shadowing(self, cos_o: Doubles, cos_i: Doubles) -> Doubles:
        return np.asarray(1 / (1 + self._lambda(cos_o) + self._lambda(cos_i)))


class Lamp:
    """Emissive parallelogram: sampling, radiance and pdf."""

    def __init__(self, mesh: Mesh) -> None:
        self._corner, b, _, d = mesh.vertices.astype(np.float64)
        self._sides = np.array([b - self._corner, d - self._corner])
        across = np.cross(*self._sides)
        self._area = float(np.linalg.norm(across))
        self._normal, self._radiance = across / self._area, mesh.material.radiance[0]

    def draw(self, p: Doubles, u: Doubles) -> Doubles:
        return _unit(self._corner + u @ self._sides - p)

    def light(self, p: Doubles, wi: Doubles) -> tuple[Doubles, Doubles]:
        """Return the radiance from wi, (n,), and the pdf of `draw`."""
        facing = -wi @ self._normal
        t = (self._corner - p) @ self._normal / np.where(facing > 0, -facing, -1)
        places = np.linalg.lstsq(self._sides.T, (p + t[:, None] * wi - self._corner).T, rcond=None)[0]
        hit = (facing > 0) & (t > 0) & np.all((places >= 0) & (places <= 1), axis=0)
        return np.where(hit, self._radiance, 0), np.where(hit, t**2 / (self._area * np.where(hit, facing, 1)), 0)


class Sky:
    """Environment map, importance sampled by the maximum of each texel and its neighbors."""

    def __init__(self, environment: Environment) -> None:
        assert environment.image is not None
        self._texels = environment.strength * environment.image[..., 0].astype(np.float64)
        height, width = self._texels.shape
        rows = np.pad(np.pad(self._texels, ((1, 1), (0, 0)), "edge"), ((0, 0), (1, 1)), "wrap")
        bounds = np.max([rows[y : y + height, x : x + width] for y in range(3) for x in range(3)], axis=0)
        weights = bounds * np.sin((np.arange(height) + 0.5) / height * np.pi)[:, None]
        self._chances = weights / weights.sum()
        self._sums = np.cumsum(self._chances)

    def draw(self, p: Doubles, u: Doubles) -> Doubles:
        """Sample a direction. The first number selects a texel, and its remainder the horizontal position within it."""
        height, width = self._texels.shape
        texel = np.minimum(np.searchsorted(self._sums, u[:, 0], "right"), self._texels.size - 1)
        chance = self._chances.ravel()[texel]
        rest = np.clip((u[:, 0] - self._sums[texel] + chance) / chance, 0, 1)
        phi, theta = 2 * np.pi * (texel % width + rest) / width, np.pi * (texel // width + u[:, 1]) / height
        return np.column_stack([np.sin(theta) * np.sin(phi), np.cos(theta), -np.sin(theta) * np.cos(phi)])

    def light(self, p: Doubles, wi: Doubles) -> tuple[Doubles, Doubles]:
        """Return the radiance, bilinearly interpolated between texels, and the pdf of `draw`."""
        height, width = self._texels.shape
        u = np.arctan2(wi[:, 0], -wi[:, 2]) / (2 * np.pi) % 1 * width
        v = np.arccos(np.clip(wi[:, 1], -1, 1)) / np.pi * height
        column, row = np.floor(u - 0.5).astype(int), np.floor(v - 0.5).astype(int)
        x, y = u - 0.5 - column, v - 0.5 - row
        rows = [np.clip(row + k, 0, height - 1) for k in (0, 1)]
        upper, lower = (
            (1 - x) * self._texels[each, column % width] + x * self._texels[each, (column + 1) % width] for each in rows
        )
        sine = np.maximum(np.sqrt(np.maximum(1 - wi[:, 1] ** 2, 0)), 1e-12)
        chance = self._chances[np.minimum(v.astype(int), height - 1), np.minimum(u.astype(int), width - 1)]
        return (1 - y) * upper + y * lower, chance * height * width / (2 * np.pi**2 * sine)


def floor_radiance(scene: Scene, model: Model = MODELS["model"], seed: int = 0) -> Estimate:
    """Estimate the mean radiance (red) of a scene's image, which must show only its first mesh, the floor y = 0.

    Its material is white, `diffuse` or `metallic_roughness`; it is lit directly by delta lights, or by one further
    mesh, or by an environment map. This is Monte Carlo integration over pixels and directions, which are sampled in
    turn from the light, the specular lobe and the cosine, with the pdf of the mixture (the balance heuristic of Veach
    and Guibas 1995).
    """
    material = scene.meshes[0].material
    plastic = Plastic(untextured(material.roughness), model) if isinstance(material, MetallicRoughness) else None
    bsdf: Bsdf = plastic if plastic else lambda wo, wi: np.full(len(wo), 1 / np.pi)
    assert plastic or isinstance(material, Diffuse)
    source = Lamp(scene.meshes[1]) if scene.meshes[1:] else None if scene.lights else Sky(scene.environment)
    rng = np.random.default_rng(seed)
    means = []
    for _ in range(BATCHES):
        p, wo = _seen(scene.camera, rng.random((BATCH, 2)))
        if source is None:
            means.append(sum(float(np.mean(_delta(bsdf, light, p, wo))) for light in scene.lights))
        else:
            means.append(float(np.mean(_extended(bsdf, plastic, source, p, wo, rng.random((BATCH, 2))))))
    return Estimate(float(np.mean(means)), float(np.std(means) / (BATCHES - 1) ** 0.5))


def _seen(camera: Camera, u: Doubles) -> tuple[Doubles, Doubles]:
    """Return the points on the floor at positions (n, 2) of a square image, and the directions to the camera."""
    position = np.array(camera.position)
    forward = _unit((np.array(camera.look_at) - position)[None])[0]
    right = _unit(np.cross(forward, camera.up)[None])[0]
    half = np.tan(np.radians(camera.fov_degrees) / 2)
    x, y = (half * (2 * u - 1)).T[..., None]
    direction = _unit(forward + x * right + y * np.cross(right, forward))
    return position - position[1] / direction[:, 1:2] * direction, -direction


def _delta(bsdf: Bsdf, light: Light, p: Doubles, wo: Doubles) -> Doubles:
    if isinstance(light, DirectionalLight):
        wi, irradiance = np.tile(-_unit(np.array([light.direction])), (len(p), 1)), np.full(len(p), light.irradiance[0])
    else:
        assert isinstance(light, PointLight)
        away = np.array(light.position) - p
        wi, irradiance = _unit(away), light.intensity[0] / np.sum(away**2, axis=1)
    return np.asarray(bsdf(wo, wi) * wi[:, 1] * irradiance)


def _extended(bsdf: Bsdf, plastic: Plastic | None, source: Lamp | Sky, p: Doubles, wo: Doubles, u: Doubles) -> Doubles:
    around = np.sqrt(u[:, 0]), 2 * np.pi * u[:, 1]
    cosine = np.column_stack([around[0] * np.cos(around[1]), np.sqrt(1 - u[:, 0]), around[0] * np.sin(around[1])])
    drawn = [source.draw(p, u), cosine] + ([plastic.draw(wo, u)] if plastic else [])
    wi = np.select([(np.arange(len(p)) % len(drawn) == i)[:, None] for i in range(len(drawn))], drawn)
    up = wi[:, 1] > 1e-9
    wi = np.where(up[:, None], wi, [0.0, 1.0, 0.0])
    radiance, density = source.light(p, wi)
    densities = [density, wi[:, 1] / np.pi] + ([plastic.density(wo, wi)] if plastic else [])
    return np.where(up, bsdf(wo, wi) * wi[:, 1] * radiance / np.mean(densities, axis=0), 0)


def _unit(v: Doubles) -> Doubles:
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))
