"""Measures the responsiveness of a live session: frames per second while the camera moves, latency of edits, and how
long a window's thread would wait for the Python interpreter while the renderer works.

    python tests/walk_live.py SCENE --size 1280x720 --seconds 10
"""

from __future__ import annotations

import argparse
import threading
import time
from dataclasses import replace

import numpy as np

import clrt
from clrt.live.live import Live
from clrt.live.snapshot import Snapshot
from clrt.scene.editing import materials_of, with_material
from clrt.scene.materials.material_types import Diffuse
from clrt.scene.model import Scene

#: Seconds between two camera steps, and between two wake-ups of the waiting thread.
STEP, LOOK = 1 / 60, 0.002


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene")
    parser.add_argument("--size", default="1280x720")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--device")
    given = parser.parse_args()
    width, height = map(int, given.size.split("x"))
    scene = clrt.load(given.scene)
    scene = replace(scene, render=replace(scene.render, size=(width, height), spp=1 << 16))
    waits, done = [0.0], threading.Event()
    ticker = threading.Thread(target=tick, args=(waits, done))
    ticker.start()
    with Live(scene, device=given.device) as live:
        start = time.perf_counter()
        live.wait(lambda now: now.number > 0)
        print(f"{time.perf_counter() - start:.2f} s to the first picture, longest wait meanwhile {max(waits):.3f} s")
        walk(live, 2.0)
        waits.clear()
        pictures = walk(live, given.seconds)
        sizes = np.array([each.pixels.shape[1] for each in pictures])
        print(
            f"walking: {len(pictures) / given.seconds:.1f} images per second, {np.median(sizes):.0f} of {width} wide "
            f"({sizes.min()} to {sizes.max()})"
        )
        live.wait(lambda now: now.pixels.shape[1] == width and now.spp >= 2)
        print(f"edits at rest, seconds to the first picture, small or whole: {latencies(live)}")
        print(
            f"waits of another thread beyond its {LOOK} s: median {np.median(waits):.4f}, 99 % "
            f"{np.percentile(waits, 99):.4f}, longest {max(waits):.4f} s"
        )
    done.set()
    ticker.join()


def tick(waits: list[float], done: threading.Event) -> None:
    """Record by how many seconds each wake-up is late."""
    last = time.perf_counter()
    while not done.is_set():
        time.sleep(LOOK)
        now = time.perf_counter()
        waits.append(now - last - LOOK)
        last = now


def walk(live: Live, seconds: float) -> list[Snapshot]:
    """Move the camera sideways and back; return the images that were available between steps."""
    pictures: dict[int, Snapshot] = {}
    scene, first, start = live.scene, live.snapshot().number, time.perf_counter()
    while (now := time.perf_counter() - start) < seconds:
        live.edit(stepped(scene, 0.05 * np.sin(now)), moving=True, step=False)
        time.sleep(STEP)
        seen = live.snapshot()
        pictures[seen.number] = seen
    pictures.pop(first, None)
    return list(pictures.values())


def stepped(scene: Scene, part: float) -> Scene:
    """Return the scene with its camera moved sideways by a fraction of the distance to its target."""
    camera = scene.camera
    side = np.cross(np.subtract(camera.look_at, camera.position), camera.up) * part
    x, y, z = (np.array(camera.position) + side).tolist()
    return replace(scene, camera=replace(camera, position=(x, y, z)))


def latencies(live: Live) -> str:
    """Return the latencies of some edits of a material, each with another color."""
    took = []
    name, material = next(iter(materials_of(live.scene).items()))
    for i in range(10):
        material, old = Diffuse(color=(0.1 * i, 0.5, 0.5)), material
        start = time.perf_counter()
        live.edit(with_material(live.scene, old, material))
        live.wait(lambda now: now.asked == live.asked, 60)
        took.append(time.perf_counter() - start)
        time.sleep(0.5)
    return f"material {name}: median {np.median(took[1:]):.3f}, longest {max(took[1:]):.3f}"


if __name__ == "__main__":
    main()
