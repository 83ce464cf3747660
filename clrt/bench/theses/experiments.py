"""Experiments of two theses, repeated: frames with and without a BVH, rasterized and traced, by depth of mirrors.

N: Nadolny, "Ray Tracing w czasie rzeczywistym", Toruń 2026, tables 5.1 and 5.2. S: Suchiński, "Implementation of the
Ray Tracing algorithm in Vulkan technology", Łódź 2022, 7.5. Their scenes are not available; these are similar (see
thesis_scenes.py). A frame is the device's work, from the first launch to the end of the last; nothing is displayed.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import fmean, median
from typing import Any, NamedTuple

from ...rendering.renderer import Renderer
from ...scene.materials.material_types import Material
from ...scene.model import Scene
from .thesis_scenes import GLASS, STONE, dragon_scene, hall, tree_scene

MACHINES = {"N": "Radeon RX 9070 XT", "S": "GeForce RTX 2060 mobile, ray tracing in hardware"}
#: Path depths: the camera ray and one segment per bounce.
TEN_BOUNCES, TWO_BOUNCES = 11, 3
RASTER: dict[str, Any] = {"integrator": "raster", "shadows": False, "max_depth": 2}
#: Name, title, material of the statue, whether it is far away, and their frames per second at DEPTHS.
MIRRORS: list[tuple[str, str, Material, bool, tuple[float, ...]]] = [
    ("mirrors", "S 7.5, shot 2: between two parallel mirrors", STONE, False, (446, 440, 435)),
    ("mirror", "S 7.5, shot 2, the statue a mirror", GLASS, False, (215, 187, 174)),
    ("far", "S 7.5, shot 3, the statue a mirror, less of it in view", GLASS, True, (300, 277, 268)),
]
#: Distance by which the camera alternates between frames.
STEP = 1e-4
DEPTHS, MORE_DEPTHS = (4, 10, 25), (1, 2, 4, 7, 10, 16, 25, 40)


@dataclass(frozen=True)
class Variant:
    """One row. theirs: seconds per frame in the thesis; part: factor by which width and height are reduced, as the full
    image would take too long; times are multiplied by its square; depth: abscissa of a curve; options: of Renderer."""

    name: str
    scene: Scene
    options: Mapping[str, Any]
    theirs: float | None = None
    part: int = 1
    depth: int | None = None

    @property
    def max_depth(self) -> int:
        """Path depth."""
        return int(self.options.get("max_depth", self.scene.render.max_depth))

    @property
    def shared(self) -> str:
        """Key that is equal for variants that can share a renderer: they differ in depth only."""
        return repr((self.part, sorted((name, value) for name, value in self.options.items() if name != "max_depth")))


@dataclass(frozen=True)
class Experiment:
    """An experiment. ratios: pairs of variants: how many times as long the first takes as the second."""

    name: str
    title: str
    thesis: str
    variants: list[Variant]
    ratios: list[tuple[str, str]] = field(default_factory=list)


class Effort(NamedTuple):
    """Extent of a measurement. seconds: for all frames of a variant, roughly; rounds: most frames; detail: of the hall;
    smaller: divisor of width and height; part: of images without a BVH; depths: of curves."""

    seconds: float = 6.0
    rounds: int = 200
    detail: int = 4
    smaller: int = 1
    part: int = 5
    depths: Sequence[int] = MORE_DEPTHS


QUICK = Effort(seconds=0.3, rounds=5, detail=1, smaller=4, part=4, depths=DEPTHS)


@dataclass(frozen=True)
class Models:
    """Model files that replace the generated models."""

    dragon: Path | None = None
    tree: Path | None = None
    statue: Path | None = None


def experiments(effort: Effort = Effort(), models: Models = Models()) -> Iterator[Experiment]:
    """Yield all experiments, in the order of the theses."""
    part = effort.part
    yield _with_and_without(
        "dragon",
        "N table 5.1: a dragon of 19 332 triangles, 2200x1331, 10 bounces, 6 rays",
        dragon_scene(models.dragon),
        effort,
        19.54e-3,
        None,
        part,
        697e-3,
    )
    yield _with_and_without(
        "tree", "N table 5.2: a tree of 264 triangles, likewise", tree_scene(models.tree), effort, 7.76e-3, 60e-3, 1
    )
    yield _shadows(effort, models)
    for name, title, material, far, traced in MIRRORS:
        scene = hall(effort.detail, models.statue, mirrors=True, figure=material, far=far)
        yield _mirrors(name, title, scene, effort, dict(zip(DEPTHS, traced)))


def _with_and_without(
    name: str,
    title: str,
    scene: Scene,
    effort: Effort,
    theirs: float,
    without: float | None,
    part: int,
    less: float | None = None,
) -> Experiment:
    """Return an experiment with and without a BVH. less: their time without, for two bounces and one ray per pixel."""
    scene = _smaller(scene, effort)
    all_of_it, few = {"max_depth": TEN_BOUNCES, "spp": 6}, {"max_depth": TWO_BOUNCES, "spp": 1}
    variants = [
        Variant("with a tree", scene, all_of_it, theirs),
        Variant("without", scene, {**all_of_it, "layout": "list"}, without, 2 * part if part > 1 else 1),
        Variant("without, eight at a time", scene, {**all_of_it, "layout": "packs"}, None, part),
    ]
    ratios = [("without", "with a tree"), ("without, eight at a time", "with a tree")]
    if less is not None:
        variants += [
            Variant("without, 2 bounces, 1 ray", scene, {**few, "layout": "list"}, less, part),
            Variant("eight at a time, 2 bounces, 1 ray", scene, {**few, "layout": "packs"}, None, part),
        ]
        ratios += [("without, 2 bounces, 1 ray", "with a tree"), ("eight at a time, 2 bounces, 1 ray", "with a tree")]
    return Experiment(name, title, "N", variants, ratios)


def _shadows(effort: Effort, models: Models) -> Experiment:
    scene = _smaller(hall(effort.detail, models.statue), effort)
    variants = [
        Variant("hard shadows, traced", scene, {"max_depth": 2}, 1 / 537),
        Variant("rasterised, no shadows", scene, RASTER, 1 / 540),
    ]
    return Experiment(
        "shadows",
        "S 7.5: a hall of 700 thousand triangles and a point light, 1280x720",
        "S",
        variants,
        [("hard shadows, traced", "rasterised, no shadows")],
    )


def _mirrors(name: str, title: str, scene: Scene, effort: Effort, traced: Mapping[int, float]) -> Experiment:
    scene = _smaller(scene, effort)
    variants = [
        Variant(
            f"depth {depth}",
            scene,
            {"max_depth": depth + 1},
            1 / traced[depth] if depth in traced else None,
            depth=depth,
        )
        for depth in effort.depths
    ]
    dull = replace(
        scene, meshes=[replace(mesh, material=STONE) if mesh.material == GLASS else mesh for mesh in scene.meshes]
    )
    variants.append(Variant("rasterised, no reflections", dull, RASTER, 1 / 530 if name == "mirrors" else None))
    return Experiment(name, title, "S", variants, [("depth 25", "depth 4")])


def _smaller(scene: Scene, effort: Effort) -> Scene:
    width, height = scene.render.size
    return replace(scene, render=replace(scene.render, size=(width // effort.smaller, height // effort.smaller)))


def measure_theses(
    effort: Effort = Effort(),
    models: Models = Models(),
    *,
    device: str | int | None = None,
    say: Callable[[str], None] = lambda message: None,
) -> Iterator[dict[str, Any]]:
    """Yield the results of `clrt bench theses`, experiment by experiment: see `measure_experiment`."""
    for experiment in experiments(effort, models):
        yield measure_experiment(experiment, effort, device=device, say=say)


def measure_experiment(
    experiment: Experiment,
    effort: Effort,
    *,
    device: str | int | None = None,
    say: Callable[[str], None] = lambda message: None,
) -> dict[str, Any]:
    """Return the results of an experiment.

    name, title, thesis, machine (theirs), device, device_type, platform; triangles, size; rows: for each variant
    `seconds` per frame, the median, `cpu_seconds` and `mean`, `frames` measured, `frames_per_second`, `rays` and
    `samples` per frame, `theirs` (seconds), `part`, `depth` and `layout`; ratios: `of`, `over`, `ours`, `cpu` (of
    processor time), `theirs`. say: called with what is being rendered. Raises what `Renderer` raises.
    """
    renderers: dict[str, Renderer] = {}
    runs = {}
    for variant in experiment.variants:
        say(f"{experiment.name}: {variant.name}")
        if variant.shared not in renderers:
            renderers[variant.shared] = _renderer(variant, experiment.variants, device)
        runs[variant.name] = Run(variant, renderers[variant.shared])
    return _figures(experiment, runs, _take_turns(runs, effort))


def _renderer(variant: Variant, variants: Sequence[Variant], device: str | int | None) -> Renderer:
    """Return a renderer for all variants that share it: some devices must know the largest depth."""
    width, height = variant.scene.render.size
    depths = [other.max_depth for other in variants if other.shared == variant.shared]
    return Renderer(
        variant.scene,
        device=device,
        **{"spp": 1, **variant.options, "max_depth": max(depths)},
        size=(max(1, width // variant.part), max(1, height // variant.part)),
    )


class Taken(NamedTuple):
    """Time of a frame. cpu_seconds: of all processors."""

    seconds: float
    cpu_seconds: float


class Run:
    """Frames of a variant, after a warm-up frame."""

    def __init__(self, variant: Variant, renderer: Renderer) -> None:
        self.variant, self.renderer, self.spp = variant, renderer, variant.options.get("spp", 1)
        self._step = STEP
        self.seconds, _ = self.frame()
        film = self.renderer.session.film()
        self.rays, self.samples = film.rays * variant.part**2, film.samples * variant.part**2

    def frame(self) -> Taken:
        """Render a frame and return the time of a full image. The camera moves, so that nothing can be reused."""
        session, camera = self.renderer.session, self.renderer.scene.camera
        self._step = -self._step
        x, y, z = camera.position
        session.look(replace(camera, position=(x + self._step, y, z)))
        session.launch["max_depth"] = self.variant.max_depth
        session.wait()
        start, cpu, whole = time.perf_counter(), time.process_time(), self.variant.part**2
        for _ in session.render(self.spp):
            pass
        session.wait()
        return Taken((time.perf_counter() - start) * whole, (time.process_time() - cpu) * whole)


def _take_turns(runs: Mapping[str, Run], effort: Effort) -> dict[str, list[Taken]]:
    """Return the frames of each run, interleaved, within the time limit of each."""
    taken: dict[str, list[Taken]] = {name: [] for name in runs}
    for _ in range(effort.rounds):
        for name, run in runs.items():
            spent = sum(frame.seconds for frame in taken[name]) / run.variant.part**2
            if not taken[name] or spent + run.seconds / run.variant.part**2 <= effort.seconds:
                taken[name].append(run.frame())
    return taken


def _figures(experiment: Experiment, runs: Mapping[str, Run], taken: Mapping[str, list[Taken]]) -> dict[str, Any]:
    rows: dict[str, dict[str, Any]] = {}
    for name, run in runs.items():
        seconds, cpu_seconds = (median(each) for each in zip(*taken[name]))
        rows[name] = {
            "seconds": seconds,
            "cpu_seconds": cpu_seconds,
            "frames": len(taken[name]),
            "mean": fmean(frame.seconds for frame in taken[name]),
            "frames_per_second": 1 / seconds,
            "rays": run.rays,
            "samples": run.samples,
            "theirs": run.variant.theirs,
            "part": run.variant.part,
            "depth": run.variant.depth,
            "layout": run.renderer.compiled.tree.name,
        }
    ratios = []
    for name, other in experiment.ratios:
        above, below = runs[name].variant.theirs, runs[other].variant.theirs
        ours, cpu = (rows[name][key] / max(rows[other][key], 1e-9) for key in ("seconds", "cpu_seconds"))
        ratios.append(
            {"of": name, "over": other, "ours": ours, "cpu": cpu, "theirs": above / below if above and below else None}
        )
    first = next(iter(runs.values())).renderer
    info = first.device.info
    return {
        "name": experiment.name,
        "title": experiment.title,
        "thesis": experiment.thesis,
        "machine": MACHINES[experiment.thesis],
        "device": info.name,
        "device_type": info.type,
        "platform": info.platform,
        "triangles": int(first.compiled.counts["triangles"][0]),
        "size": experiment.variants[0].scene.render.size,
        "rows": rows,
        "ratios": ratios,
    }
