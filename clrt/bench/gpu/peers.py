"""Other libraries and renderers on the same device: Warp and Mitsuba, if installed; with CUDA on a GPU."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter

from ...device.discovery.discover import choose
from ...errors import UsageError
from ...formats.load_scene import load
from ...queries.mesh import RayQuery
from ...rendering.renderer import Renderer
from ..rays.ray_libraries import Call, clrt, warp
from ..rays.workloads import bumpy_ball, closed_room, workloads
from ..renderers.mitsuba_renderer import Mitsuba, load as load_mitsuba
from ..renderers.mitsuba_scene import mitsuba_scene
from .gallery import steady_rate
from .request import Item, Request, Row
from .small_scenes import smaller

SUBDIVISIONS, SIDE, QUICK_SUBDIVISIONS, QUICK_SIDE = 7, 1024, 2, 16
#: Scenes, of those that Mitsuba has equivalents for, and samples per pixel.
SCENES, SPP = ("cornell", "glass", "dragon"), 64
ROUNDS = 5


def items(request: Request) -> Iterator[Item]:
    """Yield calls of clrt and Warp, and images of Mitsuba."""
    gpu = choose(request.device)[0].type == "gpu"
    for kind in ("primary", "bounce"):
        yield Item(f"rays, {kind}", partial(_calls, kind, request, "cuda:0" if gpu else "cpu"))
    for file in map(Path, request.scenes):
        if file.stem in SCENES:
            yield Item(f"Mitsuba, {file.stem}", partial(_mitsuba, file, request, "cuda_ad_rgb" if gpu else None))


def _calls(name: str, request: Request, device: str) -> Row:
    """Return millions of rays per second of whole calls, from numpy arrays to numpy arrays."""
    ball = bumpy_ball(QUICK_SUBDIVISIONS if request.quick else SUBDIVISIONS)
    room, side = closed_room(*ball), QUICK_SIDE if request.quick else SIDE
    query = RayQuery(*room, device=request.device)
    kinds = workloads(*room, ball[0], query.closest_hit, (side, side))
    origins, directions, _ = next(kind.rays for kind in kinds if kind.name == name)
    try:
        other = warp(*room, device)
    except ImportError as error:
        raise UsageError("Warp is not installed (pip install warp-lang)") from error
    calls: dict[str, Call] = {"clrt": clrt(query), "warp": other}
    return {
        "rays": len(origins),
        "on": device,
        **{
            f"{key}_mrays": 1e-6 * len(origins) / _median_seconds(partial(call, origins, directions))
            for key, call in calls.items()
        },
    }


def _median_seconds(run: Callable[[], object]) -> float:
    run()
    taken = []
    for _ in range(ROUNDS):
        start = perf_counter()
        run()
        taken.append(perf_counter() - start)
    return median(taken)


def _mitsuba(file: Path, request: Request, variant: str | None) -> Row:
    """Return samples per second of Mitsuba and of clrt, in millions."""
    try:
        library, name = load_mitsuba(variant)
    except ImportError as error:
        raise UsageError("Mitsuba is not installed (pip install mitsuba)") from error
    scene = smaller(load(file)) if request.quick else load(file)
    renderer, spp = Mitsuba(library, mitsuba_scene(scene)), 1 if request.quick else SPP
    image = min((renderer(spp, seed) for seed in range(2)), key=lambda image: image.seconds)
    width, height = scene.render.size
    ours = Renderer(scene, device=request.device, spp=None, seed=1)
    return {
        "on": name,
        "spp": image.spp,
        "seconds": image.seconds,
        "clrt_msamples": (steady_rate(ours, 0.0, 0.0) if request.quick else steady_rate(ours))["msamples"],
        "mitsuba_msamples": 1e-6 * image.spp * width * height / image.seconds,
        "mean": float(image.pixels.mean()),
    }
