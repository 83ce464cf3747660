"""Measurements of a farm's results and costs on one machine: `clrt bench farm`."""

from __future__ import annotations

import random
import tempfile
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from threading import Event, Thread
from typing import Any

import numpy as np

from ..bench.process_memory import peak_bytes
from ..rendering.renderer import Renderer, State
from ..scene.camera_path import frames, turntable
from ..scene.model import RenderSettings, Scene
from .banded_picture import BandedPicture
from .cluster import connect, local_cluster
from .farm_renderer import FarmRenderer
from .local_processes import Processes
from .orders import PictureOrder
from .whole_pictures import WholePictures

#: Samples per second of a simulated worker: as many as two cores render of the Cornell box.
SPEED = 4e6
#: Simulated workers per process.
IN_PROCESS = 16
Row = dict[str, Any]


@contextmanager
def farm(workers: int = 0, simulated: int = 0) -> Iterator[Processes]:
    """Run a scheduler and workers in separate processes."""
    with tempfile.TemporaryDirectory() as folder, Processes(Path(folder)) as processes:
        processes.add_workers(workers)
        for first in range(0, simulated, IN_PROCESS):
            processes.add_simulated(min(IN_PROCESS, simulated - first))
        yield processes


def equality(scenes: list[Scene], spp: int) -> Iterator[Row]:
    """Compare the films of each scene by one process, by two of --local-cluster, and by four of a scheduler."""
    with local_cluster(2) as two, farm(4) as processes, connect(processes.address) as four:
        for scene in scenes:
            alone = Renderer(scene, spp=spp)
            last = _run(alone, spp)
            for name, cluster, count in (("--local-cluster 2", two, 2), ("4 processes", four, 4)):
                together = FarmRenderer(scene, cluster, spp=spp)
                together.session.dispatch.wait_for(count)
                found = _run(together, spp)
                yield {
                    "trial": "equality",
                    "scene": scene.name,
                    "workers": name,
                    "spp": spp,
                    "equal": same_film(last, found),
                    "same_noise": last.noise == found.noise,
                    "seconds": together.seconds,
                    "seconds_alone": alone.seconds,
                    "bytes_a_sample": together.session.moved_bytes / found.film.samples,
                }


def animation(scene: Scene, count: int, spp: int) -> Iterator[Row]:
    """Compare the frames of a turntable by one process, by two of --local-cluster, and by four of a scheduler."""
    shots = {f"frame {number}": PictureOrder(shot, spp=spp) for number, shot in frames(turntable(scene, count))}
    renderer = Renderer(scene, spp=spp)
    alone = {}
    for name, order in shots.items():
        renderer.look(order.scene.camera)
        alone[name] = _run(renderer, spp).pixels
    with local_cluster(2) as two, farm(4) as processes, connect(processes.address) as four:
        for named, cluster, workers in (("--local-cluster 2", two, 2), ("4 processes", four, 4)):
            pictures = WholePictures(cluster, list(shots), lambda name: shots[name])
            pictures.dispatch.wait_for(workers)
            start = time.perf_counter()
            found = dict(filter(None, pictures.results()))
            yield {
                "trial": "animation",
                "scene": scene.name,
                "workers": named,
                "frames": len(found),
                "spp": spp,
                "equal": all(np.array_equal(alone[name], found[name]["pixels"]) for name in shots),
                "seconds": time.perf_counter() - start,
            }


def kills(scene: Scene, spp: int, every: float) -> Iterator[Row]:
    """Compare renders on four workers undisturbed, and with one killed and replaced every `every` seconds."""
    alone = _run(Renderer(scene, spp=spp), spp)
    with farm(4) as processes, connect(processes.address) as cluster:
        for killing in (False, True):
            together = FarmRenderer(scene, cluster, spp=spp)
            together.session.dispatch.wait_for(4)
            stop, killed = Event(), list[int]()

            def kill() -> None:
                chance = random.Random(1)
                while not stop.wait(every):
                    killed.append(1)
                    processes.kill(chance.choice(processes.workers))
                    processes.add_workers(1)

            killer = Thread(target=kill)
            if killing:
                killer.start()
            found = _run(together, spp)
            stop.set()
            if killing:
                killer.join()
            yield {
                "trial": "kills",
                "scene": scene.name,
                "killed": len(killed),
                "seconds": together.seconds,
                "equal": same_film(alone, found),
                "same_noise": alone.noise == found.noise,
            }


def overhead(scene: Scene, workers: int, seconds: float) -> Row:
    """Measure simulated workers: parallel efficiency, data moved, and CPU time of client and scheduler."""
    import psutil  # a dependency of Dask

    width, height = scene.render.size
    spp = int(workers * SPEED * seconds / (width * height))
    with farm(simulated=workers) as processes, connect(processes.address) as cluster:
        together = FarmRenderer(scene, cluster, spp=spp, simulated=SPEED)
        together.session.dispatch.wait_for(workers)
        start, scheduler = time.process_time(), psutil.Process(processes.scheduler.pid)
        before = sum(scheduler.cpu_times()[:2])
        film = _run(together, spp).film
        return {
            "trial": "overhead",
            "workers": workers,
            "spp": spp,
            "seconds": together.seconds,
            "efficiency": film.samples / (workers * SPEED * together.seconds),
            "bytes_a_sample": together.session.moved_bytes / film.samples,
            "tasks": together.session.dispatch.sent,
            "client_seconds": time.process_time() - start,
            "scheduler_seconds": sum(scheduler.cpu_times()[:2]) - before,
            "client_bytes": peak_bytes(),
        }


def huge(scene: Scene, size: tuple[int, int], spp: int, workers: int, path: Path) -> Row:
    """Render a large image of normals, which are cheap, in bands, and measure the client's peak memory."""
    with (
        tempfile.TemporaryDirectory(dir=".") as folder,
        farm(workers) as processes,
        connect(processes.address) as cluster,
    ):
        banded = BandedPicture(
            PictureOrder(scene, {"size": size, "integrator": "normals"}, spp=spp), Path(folder) / "huge.bands"
        )
        start = time.perf_counter()
        for _ in banded.render(cluster):
            pass
        rendered = time.perf_counter() - start
        banded.save(path, "srgb", 0.0, {})
        return {
            "trial": "huge",
            "size": f"{size[0]}x{size[1]}",
            "spp": spp,
            "workers": workers,
            "seconds": rendered,
            "writing_seconds": time.perf_counter() - start - rendered,
            "file_bytes": path.stat().st_size,
            "samples": banded.summary()["samples"],
            "client_bytes": peak_bytes(),
        }


def sized(scene: Scene, size: tuple[int, int]) -> Scene:
    """Return the scene with images of this size."""
    settings: RenderSettings = replace(scene.render, size=size)
    return replace(scene, render=settings)


def same_film(one: State, other: State) -> bool:
    """Return whether two films are bit-identical."""
    return one.film.pixels.tobytes() == other.film.pixels.tobytes()


def _run(renderer: Renderer, spp: int) -> State:
    return deque(renderer.passes(spp=spp), maxlen=1).pop()  # keeps only the last state in memory
