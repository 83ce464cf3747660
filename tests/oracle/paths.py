"""Path tracing by BSDF sampling: radiance of emitters that paths hit, and of delta lights summed at path vertices."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from clrt.scene.materials.material import Material
from clrt.scene.model import Scene

from .camera import camera_rays
from .geometry import Geometry, Hits
from .lights import arriving, delta_lights, escaped
from .materials import scattering_of
from .surface import Surface, surface_at
from .vectors import Bools, Doubles, Frame, Whole, dot


@dataclass
class Rays:
    """Next segments of paths: sample is a path's index, throughput (n, 3) the share of radiance from there that
    reaches the camera, absorption (n, 3) per length along the segment."""

    sample: Whole
    origin: Doubles
    direction: Doubles
    throughput: Doubles
    absorption: Doubles

    def rows(self, chosen: Bools) -> Rays:
        """Return a subset."""
        return Rays(*(getattr(self, each.name)[chosen] for each in fields(self)))

    @staticmethod
    def joined(parts: list[Rays]) -> Rays:
        """Concatenate several."""
        return Rays(*(np.concatenate([getattr(part, each.name) for part in parts]) for each in fields(Rays)))


class Paths:
    """Path tracer for a scene, with paths of at most `max_depth` segments."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.geometry = scene, Geometry(scene)
        self._delta_lights = delta_lights(scene)
        transparent = [each.opacity != 1 or each.one_sided for each in self.geometry.materials]
        self._transparent = np.array(transparent, bool)[self.geometry.material]
        triangles = len(self.geometry.colors)
        self._transparent[:triangles] |= (self.geometry.colors[:, :, 3] < 1).any(axis=1)

    def samples(self, spp: int, rng: np.random.Generator) -> Doubles:
        """Return samples (h, w, spp, 3), uniform over each pixel."""
        width, height = self.scene.render.size
        row, column = np.divmod(np.repeat(np.arange(width * height), spp), width)
        places = np.column_stack([column, row]) + rng.random((len(row), 2))
        rays = camera_rays(self.scene.camera, (width, height), places, rng)
        return self.radiance(*rays, rng).reshape(height, width, spp, 3)

    def radiance(self, origin: Doubles, direction: Doubles, rng: np.random.Generator) -> Doubles:
        """Return radiance (n, 3) along camera rays (n, 3), one sample each."""
        light = np.zeros_like(origin)
        rays = Rays(np.arange(len(origin)), origin, direction, np.ones_like(origin), np.zeros_like(origin))
        for depth in range(1, self.scene.render.max_depth + 1):
            hits, surface = self._first_stop(rays.origin, rays.direction, rng)
            rays.throughput = rays.throughput * _transmittance(rays.absorption, hits.t)
            out = rays.rows(hits.missed)
            light[out.sample] += out.throughput * escaped(self.scene, out.direction)
            beyond = []
            for number in np.unique(self.geometry.material[hits.primitive[~hits.missed]]):
                mine = ~hits.missed & (self.geometry.material[hits.primitive] == number)
                material, at, arrived = self.geometry.materials[number], surface.rows(mine), rays.rows(mine)
                light[arrived.sample] += arrived.throughput * at.emitted(material)
                if depth < self.scene.render.max_depth:
                    direct, scattered = self._scattered(arrived, at, material, rng)
                    light[arrived.sample] += direct
                    beyond.append(scattered)
            if not beyond:
                break
            rays = Rays.joined(beyond)
        return light

    def _scattered(self, rays: Rays, at: Surface, material: Material, rng: np.random.Generator) -> tuple[Doubles, Rays]:
        """Return radiance (n, 3) from delta lights to the camera, and the next segments, of rays that hit one
        material."""
        scattering, frame = scattering_of(material, at), Frame(at.shading_normal)
        wo = frame.to_local(-rays.direction)
        inside = rays.absorption if scattering.absorption_beyond is None else scattering.absorption_beyond

        def absorption(wi: Doubles) -> Doubles:
            return np.where(dot(wi, at.normal)[:, None] > 0, rays.absorption, inside)

        direct = np.zeros_like(rays.origin)
        for each in self._delta_lights:
            towards, distance, irradiance = arriving(each, at.p)
            wi = frame.to_local(towards)
            value = scattering.evaluate(wo, wi) * irradiance * _same_side(at, wi, towards)
            reaches = self._visible(at.p, towards, distance, np.any(value, axis=1), rng)[:, None]
            direct += rays.throughput * value * reaches * _transmittance(absorption(towards), distance)
        wi, weight = scattering.sample(wo, rng)
        onward = frame.to_world(wi)
        throughput = rays.throughput * weight * _same_side(at, wi, onward)
        return direct, Rays(rays.sample, at.p, onward, throughput, absorption(onward)).rows(np.any(throughput, axis=1))

    def _first_stop(self, origin: Doubles, direction: Doubles, rng: np.random.Generator) -> tuple[Hits, Surface]:
        """Return the hit that stops each ray: surfaces stop it with the probability of their
        opacity. t is from `origin`.
        """
        hits = self.geometry.nearest(origin, direction)
        surface = surface_at(self.geometry, hits, origin, direction)
        undecided = np.flatnonzero(self._may_pass(hits))
        while len(undecided):
            numbers, at = self.geometry.material[hits.primitive[undecided]], surface.rows(undecided)
            rows = undecided[rng.random(len(undecided)) >= self._opacity(numbers, at)]
            beyond = self.geometry.nearest(surface.p[rows], direction[rows])
            surface.put(rows, surface_at(self.geometry, beyond, surface.p[rows], direction[rows]))
            hits.t[rows] += beyond.t
            hits.primitive[rows], hits.weights[rows] = beyond.primitive, beyond.weights
            undecided = rows[self._may_pass(beyond)]
        return hits, surface

    def _may_pass(self, hits: Hits) -> Bools:
        """Return whether each ray hit a material that does not stop all light."""
        if not self._transparent.any():
            return np.zeros(len(hits.t), bool)
        return np.asarray(~hits.missed & self._transparent[hits.primitive])

    def _opacity(self, numbers: Whole, at: Surface) -> Doubles:
        """Return the opacity (n,) of materials by their indices."""
        opacity = np.ones(len(numbers))
        for number in np.unique(numbers):
            mine = numbers == number
            opacity[mine] = at.rows(mine).opacity(self.geometry.materials[number])
        return opacity

    def _visible(self, p: Doubles, wi: Doubles, distance: Doubles, asked: Bools, rng: np.random.Generator) -> Doubles:
        """Return 1 where nothing blocks a delta light, 0 elsewhere or where `asked` is false, (n,)."""
        seen = np.zeros(len(p))
        if asked.any():
            hits, _ = self._first_stop(p[asked], wi[asked], rng)
            seen[asked] = hits.t >= distance[asked]
        return seen


def _same_side(at: Surface, local: Doubles, world: Doubles) -> Doubles:
    """Return 1 if a direction is on the same side by the shading and the geometric normal, else 0, (n, 1)."""
    alike: Bools = (local[:, 2:] > 0) == (dot(world, at.normal)[:, None] > 0)
    return alike.astype(float)


def _transmittance(absorption: Doubles, distance: Doubles) -> Doubles:
    """Return the transmittance (n, 3) after a distance (n,), which may be infinite."""
    return np.asarray(np.exp(-absorption * np.where(absorption > 0, distance[:, None], 0)))
