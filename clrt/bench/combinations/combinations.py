"""Test identities of images (identities.py) over random scenes, with corrected significance.

Each side of an identity is rendered with several seeds. The means over blocks of pixels and over the whole image, by
channel, are compared by Student's t over the differences per seed; the smallest p-value is corrected for the number of
tests. A suspicious scene is rendered again with fresh seeds and more samples, up to four times. The p-value of the last
round alone, which does not depend on the earlier ones, decides: suspicion costs no significance, and heavy-tailed
differences, for which t-tests of few samples reject too often, are judged from the most samples.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...device.open import Device
from ...output.scenes import save_scene
from ...rendering.accumulation.launch_plan import LaunchPlan
from ...rendering.accumulation.single_device import SingleDeviceAccumulation
from ...rendering.compile.compile_scene import compile_scene
from ...rendering.film.film import Film
from ...rendering.film.group_layers import group_layers
from ...rendering.guiding.training import Training, guided
from ..kernel_probe import choices
from ..renderers.agreement import block_means
from ..significance import FAMILY, corrected, t_test
from .identities import MODERATE, PROPERTIES, Side, brightest
from .random_draws import Draws
from .random_scenes import BATCH, random_scene

Doubles = NDArray[np.float64]

#: The training of guiding fields.
TRAINING = Training((1, 2, 4))
#: Side of a block in pixels.
BLOCK = 8
#: Differences up to this, relative to a block or to the whole image, are attributed to float32 rounding of positions.
ROUNDING = 2e-5
#: If a strategy samples a light rarely or never, the variance over seeds underestimates the error. The standard error
#: of a single strategy includes this many samples of the brightest light: as many as are unlikely to be missed, 17
#: (with p 5e-8), are then 6 standard errors.
UNSEEN = 3


class Round(NamedTuple):
    """Images with `seeds` seeds and `spp` samples per pixel; a p-value below `suspect` leads to another round."""

    seeds: int
    spp: int
    suspect: float


ROUNDS = (Round(16, 32, 0.05), Round(16, 256, 0.01), Round(32, 512, 1e-3), Round(64, 1024, 0.0))


@dataclass(frozen=True)
class Verdict:
    """The result of one property for one scene.

    side: name of the side that differs most from the first; rounds: how many were rendered. p: of the last round,
    corrected for blocks, channels and sides; difference: relative, in the block with the smallest p; mean: ratio of the
    images' means; noise: its standard error. dropped: number of non-finite samples.
    """

    property: str
    scene: str
    number: int
    side: str
    rounds: int
    p: float
    difference: float
    mean: float
    noise: float
    dropped: int

    def is_off(self, tests: int = 1) -> bool:
        """Return whether the identity is violated. With `tests` valid ones, a false alarm has probability FAMILY."""
        return self.rounds == len(ROUNDS) and corrected(self.p, tests) < FAMILY


def sides_of(name: str, seed: int, number: int) -> list[Side]:
    """Return the sides of the property `name` for scene `number` of the seed."""
    scene = random_scene(seed, number, moderate=name in MODERATE)
    return PROPERTIES[name](scene, Draws(seed + 1, number // BATCH, number))


def verdicts(device: Device, names: Iterable[str], seed: int, numbers: Sequence[int]) -> Iterator[Verdict]:
    """Yield the verdict on each property for each of these scenes of the seed."""
    for name in names:
        for number in numbers:
            yield verdict(device, name, number, sides_of(name, seed, number))


def verdict(device: Device, name: str, number: int, sides: Sequence[Side]) -> Verdict:
    """Return the verdict on a property with these sides."""
    seeds = 0
    for count, each in enumerate(ROUNDS, start=1):
        found = _compared(device, sides, each.spp, range(seeds, seeds + each.seeds))
        seeds += each.seeds
        result = Verdict(name, sides[0].scenes[0].name, number, rounds=count, **found._asdict())
        if result.p >= each.suspect:
            break
    return result


class _Comparison(NamedTuple):
    side: str
    p: float
    difference: float
    mean: float
    noise: float
    dropped: int


def _compared(device: Device, sides: Sequence[Side], spp: int, seeds: Sequence[int]) -> _Comparison:
    """Compare the first side with the one that differs most from it."""
    (first, dropped), *others = (_means(device, side, spp, seeds) for side in sides)
    sample = brightest(sides[0].scenes[0]) / (spp * len(seeds))
    found = [
        _difference(side.name, first, other, dropped + more, UNSEEN * sample if side.files else 0.0)
        for side, (other, more) in zip(sides[1:], others)
    ]
    least = min(found, key=lambda each: each.p)
    return least._replace(p=corrected(least.p, len(found)))


def _difference(name: str, first: Doubles, other: Doubles, dropped: int, unseen: float) -> _Comparison:
    """Compare means (seeds, n), the last three of which are those of the whole images by channel.

    The whole images, which reveal small differences best, are a test family of their own. unseen: the radiance, summed
    over pixels, that a side may have missed.
    """
    difference, level = other - first, (other + first).mean(0) / 2
    mean, freedom = difference.mean(0), len(difference) - 1
    rounding = ROUNDING * np.maximum(level, np.resize(level[-3:], len(level)))
    blocks = len(level) // 3 - 1
    missed = unseen / BLOCK**2 / np.repeat([1, blocks], [3 * blocks, 3])
    error = np.sqrt(difference.var(0) / freedom + rounding**2 + missed**2)
    t = np.divide(mean, error, out=np.zeros_like(mean), where=error != 0)
    p = np.array([t_test(each, freedom) for each in np.nan_to_num(t, nan=np.inf).tolist()])
    least = [corrected(float(family.min()), len(family)) for family in (p[:-3], p[-3:])]
    at = int(p[:-3].argmin()) if least[0] < least[1] else len(p) - 3 + int(p[-3:].argmin())
    whole, noise = (each[-3:].mean() / max(level[-3:].mean(), 1e-300) for each in (mean, error))
    return _Comparison(
        name,
        corrected(min(least), 2),
        float(mean[at] / max(level[at], 1e-300)),
        float((2 + whole) / (2 - whole)) if whole < 2 else float("inf"),
        float(noise),
        dropped,
    )


def _means(device: Device, side: Side, spp: int, seeds: Sequence[int]) -> tuple[Doubles, int]:
    """Return means (seeds, n) of blocks and, last, of the whole image, and the number of dropped samples."""
    rendered = [_rendered(device, side, i, spp, seeds) for i in range(len(side.scenes))]
    return np.asarray(side.scale * np.sum([rows for rows, _ in rendered], 0)), sum(dropped for _, dropped in rendered)


def _layer(film: Film, groups: Sequence[str], group: str) -> Doubles:
    return group_layers(film, groups)[groups.index(group)].astype(np.float64)


def _rendered(device: Device, side: Side, number: int, spp: int, seeds: Sequence[int]) -> tuple[Doubles, int]:
    """Return the same for one of the side's scenes."""
    scene = side.scenes[number]
    chosen = replace(choices(device), light_groups=side.group is not None, guiding="on" if side.guided else "off")
    plan = LaunchPlan.of(scene.render, spp)
    compiled, *_ = guided([device], [compile_scene(scene, chosen, device=device)], plan, TRAINING)
    files = {name: side.files.get(name, own) if own else own for name, own in compiled.chosen_files.items()}
    session = SingleDeviceAccumulation(device, replace(compiled, chosen_files=files), plan)
    rows, dropped = [], 0
    for seed in seeds:
        session.launch["seed"] = seed
        session.look(scene.camera)
        for _ in session.render(spp):
            pass
        film = session.film()
        image = film.mean if side.group is None else _layer(film, compiled.groups, side.group)
        pixels = image[:, ::-1] if side.mirrored else image
        rows.append(np.append(block_means(pixels, BLOCK).ravel(), pixels.mean((0, 1))))
        dropped += film.nonfinite_samples
    return np.array(rows), dropped


def keep_scenes(off: Verdict, seed: int, folder: Path) -> list[Path]:
    """Save the scenes of both sides that differ as scene files in `folder`; return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    first, *others = sides_of(off.property, seed, off.number)
    saved = []
    for side in (first, *(each for each in others if each.name == off.side)):
        for i, scene in enumerate(side.scenes):
            stem = re.sub(r"\W+", "-", f"{scene.name}-{off.property}-{side.name}-{i}".lower())[:100]
            saved.append(save_scene(scene, folder / f"{stem}.toml")[-1])
    return saved
