"""Comparison of the renderer's image with the oracle's, by block means and Welch's t-test.

Both render batches of samples, whose means per block and channel are independent even if pixel errors correlate.
Scenes with a suspicious difference get more samples, all of them new, until a last round decides: with
enough samples the t-test holds for a few bright paths, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple
from unittest.mock import patch

import numpy as np

from clrt.bench.kernel_probe import choices
from clrt.bench.renderers.agreement import block_means
from clrt.bench.significance import FAMILY, corrected, t_test
from clrt.device.open import Device
from clrt.rendering.accumulation.launch_plan import LaunchPlan
from clrt.rendering.accumulation.single_device import SingleDeviceAccumulation
from clrt.rendering.compile.compile_scene import compile_scene
from clrt.scene.geometry import instancing
from clrt.scene.model import Scene

from .paths import Paths
from .scenes import SIZE
from .vectors import Doubles

#: Side of a block in pixels.
BLOCK = 4
#: Relative float32 rounding error allowed in a block's mean.
ROUNDING = 1e-4


class Round(NamedTuple):
    """Batches of both renderers and their samples per pixel; a p-value below `suspect` leads to the next round."""

    batches: int
    oracle_spp: int
    spp: int
    suspect: float


ROUNDS = (Round(16, 128, 256, 0.05), Round(16, 512, 1024, 0.01), Round(32, 1024, 4096, 0.0))


@dataclass(frozen=True)
class Verdict:
    """Result of the last round.

    rounds: number of rounds; p: of the least likely block and channel, corrected for their number;
    difference: of that one, relative to the oracle; ratio, error: the renderer's mean of all pixels over
    the oracle's, and its standard error.
    """

    name: str
    rounds: int
    p: float
    difference: float
    ratio: float
    error: float

    def is_off(self, scenes: int = 1) -> bool:
        """Return whether the images differ, with an error probability of FAMILY for all of `scenes` scenes."""
        return self.rounds == len(ROUNDS) and corrected(self.p, scenes) < FAMILY

    def __str__(self) -> str:
        return (
            f"{self.name}: {self.rounds} rounds, p {self.p:.2g}, largest difference {self.difference:+.2%}, "
            f"mean {self.ratio:.4f} ± {self.error:.4f}"
        )


def verdict(device: Device, scene: Scene, seed: int = 0) -> Verdict:
    """Compare the renderer on a device with the oracle, using random numbers of this seed."""
    paths, session, rng = Paths(scene), _session(device, scene), np.random.default_rng([seed, 31])
    first = 0
    for count, each in enumerate(ROUNDS, start=1):
        oracle, brightest = _oracle(paths, each, rng)
        images = (_image(session, scene, seed + first + i, each.spp) for i in range(each.batches))
        found = _compared(
            np.array([_means(image) for image in images]), oracle, brightest / (each.batches * each.oracle_spp)
        )
        first += each.batches
        if found[0] >= each.suspect:
            break
    return Verdict(scene.name, count, *found)


def _session(device: Device, scene: Scene) -> SingleDeviceAccumulation:
    """Return a session in which instances with few triangles remain instances."""
    with patch.object(instancing, "FEW_TRIANGLES", 0):
        compiled = compile_scene(scene, choices(device), device=device)
    return SingleDeviceAccumulation(device, compiled, LaunchPlan(scene.render.size, scene.render.max_depth, 0))


def _image(session: SingleDeviceAccumulation, scene: Scene, seed: int, spp: int) -> Doubles:
    session.launch["seed"] = seed
    session.look(scene.camera)
    for _ in session.render(spp):
        pass
    film = session.film()
    assert not film.nonfinite_samples
    return film.mean


def _oracle(paths: Paths, number: Round, rng: np.random.Generator) -> tuple[Doubles, float]:
    """Return the means (batches, n), and the brightest sample of all."""
    means, brightest = [], 0.0
    for _ in range(number.batches):
        samples = paths.samples(number.oracle_spp, rng)
        means.append(_means(samples.mean(axis=2)))
        brightest = max(brightest, float(samples.max()))
    return np.array(means), brightest


def _means(image: Doubles) -> Doubles:
    """Return the means (n,) of blocks, then of all pixels, per channel."""
    return np.append(block_means(image, BLOCK).ravel(), image.mean((0, 1)))


def _compared(images: Doubles, oracle: Doubles, resolution: float) -> tuple[float, float, float, float]:
    """Return p, difference, ratio and error of a Verdict from means (batches, n).

    resolution: what one bright path adds to a pixel of the oracle, a lower bound of standard errors: the spread of
    batches does not include paths so rare that none was found.
    """
    level, difference = oracle.mean(0), images.mean(0) - oracle.mean(0)
    variances = [means.var(0, ddof=1) / len(means) for means in (images, oracle)]
    pixels = np.append(np.full(len(level) - 3, BLOCK**2), np.full(3, SIZE[0] * SIZE[1]))
    error = np.sqrt(variances[0] + variances[1] + (ROUNDING * level) ** 2 + (resolution / pixels) ** 2)
    lit = error > 0
    # Welch–Satterthwaite degrees of freedom.
    freedom = (variances[0] + variances[1]) ** 2 / np.maximum(sum(v**2 / (len(images) - 1) for v in variances), 1e-300)
    p = np.array([t_test(t, max(f, 1.0)) for t, f in zip(difference[lit] / error[lit], freedom[lit])])
    if not p.size:
        return 1.0, 0.0, 1.0, 0.0
    least = int(p.argmin())
    relative = difference[lit][least] / max(level[lit][least], 1e-300)
    whole = np.array([part[:, -3:].mean(1) for part in (images, oracle)])
    ratio = float(whole[0].mean() / max(whole[1].mean(), 1e-300))
    spread = np.sqrt(whole.var(axis=1, ddof=1) / len(images)) / np.maximum(whole.mean(axis=1), 1e-300)
    return corrected(float(p[least]), p.size), float(relative), ratio, float(ratio * np.hypot(*spread))
