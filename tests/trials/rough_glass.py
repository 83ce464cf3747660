"""A sphere of rough glass with single scattering in a white furnace: clrt and Mitsuba against float64 quadrature.

Inside a sphere the angle at which light arrives is the one at which it left, so radiance is a function of one cosine
and a solution of linear equations. Blocks of 16 x 16 pixels are compared by the spread of their means over the seeds.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from clrt.bench.convergence.contestants import choices_on
from clrt.bench.kernel_probe import Doubles
from clrt.bench.renderers.agreement import BLOCK, block_means, means_of
from clrt.bench.renderers.mitsuba_plugins.glass_losses import scattered
from clrt.bench.renderers.mitsuba_renderer import contestants
from clrt.device.discovery.discover import choose
from clrt.scene.materials.material_types import Dielectric
from clrt.scene.model import Camera, Environment, RenderSettings, Scene, Sphere

IOR, ROUGHNESS, WIDTH, SPP, SEEDS, FINER = 1.5, 0.7, 96, 32, 96, 12
#: Tabulated roots of cosines.
STEPS = 400
ROOTS = (np.arange(STEPS) + 0.5) / STEPS
DISTANCE, RADIUS, FOV_DEGREES = 4.0, 0.8, 26.0


def radiance() -> Doubles:
    """Return (STEPS,) the sphere's radiance at ROOTS for an environment of radiance 1."""
    back, entering = np.zeros((STEPS, STEPS)), np.zeros((STEPS, STEPS))
    leaving, reflected = np.zeros(STEPS), np.zeros(STEPS)
    for row in range(STEPS):
        (inside, cosines), (out, _) = scattered(1 / IOR, ROUGHNESS**2, ROOTS[row : row + 1])
        back[row], leaving[row] = _onto_roots(inside, cosines), out.sum()
        (off, _), (into, cosines) = scattered(IOR, ROUGHNESS**2, ROOTS[row : row + 1])
        entering[row], reflected[row] = _onto_roots(into, cosines), off.sum()
    return np.asarray(reflected + entering @ np.linalg.solve(np.eye(STEPS) - back, leaving))


def _onto_roots(weights: Doubles, cosines: Doubles) -> Doubles:
    """Return (STEPS,) the factors in Σ weights·f(cosines) of f at ROOTS, linear in between."""
    place = np.clip(np.sqrt(np.maximum(cosines, 0)) * STEPS - 0.5, 0, STEPS - 1 - 1e-9).ravel()
    low = place.astype(int)
    share = place - low
    return np.asarray(
        np.bincount(low, weights.ravel() * (1 - share), STEPS) + np.bincount(low + 1, weights.ravel() * share, STEPS)
    )


def expected_image() -> Doubles:
    """Return the pixels (WIDTH, WIDTH), each a mean over FINER² points."""
    across = ((np.arange(WIDTH * FINER) + 0.5) / (WIDTH * FINER) * 2 - 1) * np.tan(np.radians(FOV_DEGREES) / 2)
    away2 = np.add.outer(across**2, across**2)
    nearest2 = DISTANCE**2 * away2 / (1 + away2) / RADIUS**2  # squared, of the ray to the center, in radii
    cosine = np.sqrt(np.maximum(1 - nearest2, 0))
    fine = np.where(nearest2 < 1, np.interp(np.sqrt(cosine), ROOTS, radiance()), 1)
    return np.asarray(fine.reshape(WIDTH, FINER, WIDTH, FINER).mean((1, 3)))


def trial() -> Iterator[str]:
    glass = Dielectric(ior=IOR, roughness=ROUGHNESS, multiple_scattering=False)
    scene = Scene(
        spheres=[Sphere(radius=RADIUS, material=glass)],
        environment=Environment(color=(1.0, 1.0, 1.0)),
        camera=Camera(position=(0, 0, DISTANCE), look_at=(0, 0, 0), fov_degrees=FOV_DEGREES),
        render=RenderSettings(size=(WIDTH, WIDTH), max_depth=64),
    )
    expected = expected_image()
    blocks = block_means(np.repeat(expected[..., None], 3, axis=2), BLOCK)[..., 0]
    lit = blocks < 0.9999
    yield f"mean of the quadrature: {expected.mean():.6f}"
    for name, renderer in (choices_on(scene, [choose(None)[0].index], {"clrt": {}}) | contestants(scene)).items():
        found = means_of(renderer, SPP, range(SEEDS))
        means = found.whole[:, 0]
        errors = found.blocks[:, lit, 0].std(0, ddof=1) / SEEDS**0.5
        z = (found.blocks[:, lit, 0].mean(0) - blocks[lit]) / errors
        yield (
            f"{name:26} {means.mean():.6f} ± {means.std(ddof=1) / SEEDS**0.5:.6f}; z of {z.size} blocks: "
            f"root mean square {np.sqrt(np.mean(z**2)):.2f}"
        )
