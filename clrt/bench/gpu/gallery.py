"""The gallery: the means of its images against another device's, and samples per second by every way to trace paths."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...device.device_info import Paths
from ...device.open import open_device
from ...formats.load_scene import load
from ...output.images import read_image
from ...rendering.renderer import Renderer
from ...scene.model import Scene
from .executions import executions
from .programs import compile_ahead
from .request import Item, Request, Row
from .small_scenes import smaller

#: Samples per pixel, and width in pixels, of images to compare; with --quick.
SPP, WIDTH, QUICK_SPP, QUICK_WIDTH = 16, 512, 1, 16
#: Seconds of rendering before the measurement, in which launches grow to their full size, and of the measurement.
WARM_UP, MEASURED = 0.5, 0.8
#: Pixels are near if they differ by less than this fraction; single paths may take another branch after rounding.
NEAR = 1e-3


def image_items(request: Request) -> Iterator[Item]:
    """Yield the programs of all scenes, compiled ahead, then the scenes, to compare their images."""
    yield Item("programs", partial(compile_ahead, request))
    for file in map(Path, request.scenes):
        yield Item(file.stem, partial(_compare, file, request))


def speed_items(request: Request) -> Iterator[Item]:
    """Yield the scenes with the device's own choice of `Paths`, then with each of the others."""
    for paths in executions(request.device):
        for file in map(Path, request.scenes):
            yield Item(f"{file.stem}, {paths}", partial(_speed, file, paths, request))


def _compare(file: Path, request: Request) -> Row:
    """Return the ratio of the images' means, and the fractions of pixels that are equal and near."""
    width, spp = (QUICK_WIDTH, QUICK_SPP) if request.quick else (WIDTH, SPP)
    scene = smaller(load(file), width)
    image = _image(scene, request.device, spp)
    row: Row = {"finite": bool(np.isfinite(image).all()), "mean": float(image.mean(dtype=np.float64))}
    if request.other is not None:
        other = _image(scene, request.other, spp)
        apart = np.abs(image - other).max(axis=2)
        row |= {
            "ratio": _ratio(image, other),
            "equal": float(np.mean(apart == 0)),
            "near": float(np.mean(apart <= NEAR * np.abs(other).max(axis=2))),
        }
    if (reference := file.with_name(f"{file.stem}_reference.exr")).is_file():
        row["reference_ratio"] = _ratio(image, read_image(reference))
    return row


def _ratio(one: NDArray[np.float32], other: NDArray[np.float32]) -> float:
    return float(one.mean(dtype=np.float64) / other.mean(dtype=np.float64))


def _image(scene: Scene, device: str, spp: int) -> NDArray[np.float32]:
    renderer = Renderer(scene, device=device, spp=spp, seed=1)
    render(renderer, spp)
    return renderer.session.film().picture()


def render(renderer: Renderer, spp: int) -> None:
    """Add samples until there are `spp` per pixel, without error estimates."""
    session = renderer.session
    while session.samples_done < spp:
        for _ in session.render(min(spp - session.samples_done, session.pass_limit())):
            pass
    session.wait()


def _speed(file: Path, paths: Paths, request: Request) -> Row:
    start = time.perf_counter()
    scene = load(file)
    loaded = time.perf_counter()
    scene = smaller(scene) if request.quick else scene
    renderer = Renderer(scene, device=open_device(request.device), spp=None, paths=paths, seed=1)
    ready = time.perf_counter()
    tree = renderer.compiled.tree
    return {
        "load_seconds": loaded - start,
        "ready_seconds": ready - loaded,
        "program_seconds": renderer.session.build_seconds,
        "cached": renderer.session.cached,
        "triangles": int(renderer.compiled.counts["triangles"][0]),
        "layout": tree.name,
        "kernel": renderer.compiled.kernel,
        **(steady_rate(renderer, 0.0, 0.0) if request.quick else steady_rate(renderer)),
        "mean": float(renderer.session.film().mean.mean()),
    }


def steady_rate(renderer: Renderer, warm_up: float = WARM_UP, measured: float = MEASURED) -> Row:
    """Return samples and rays per second (in millions) after a warm-up, and the longest launch."""
    session = renderer.session
    _render_for(renderer, warm_up)
    before, start = session.film(), time.perf_counter()
    _render_for(renderer, measured)
    seconds, after = time.perf_counter() - start, session.film()
    return {
        "msamples": 1e-6 * (after.samples - before.samples) / seconds,
        "mrays": 1e-6 * (after.rays - before.rays) / seconds,
        "longest_launch": session.longest_launch,
        "spp": session.samples_done,
    }


def _render_for(renderer: Renderer, seconds: float) -> None:
    """Render passes for about this long, at least one, and wait for them."""
    session, end = renderer.session, time.perf_counter() + seconds
    while True:
        for _ in session.render(session.pass_limit()):
            pass
        if time.perf_counter() >= end:
            break
    session.wait()
