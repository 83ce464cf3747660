"""Soak test of a live session: random edits for some minutes must cause no error and no memory growth.

The edits need a few dozen programs; PoCL's compiler keeps about 2 MB for each that it compiles.

    python tests/soak_live.py SCENE --minutes 30

Prints a line every 30 s, and at the end the memory use of the process, of its heap (allocated bytes by glibc's own
count, which distinguishes a leak from the allocator's fragmentation), and of the device. Exits with 1 if any grew by
more than 5 %, if a valid edit failed, or if an invalid one succeeded.
"""

from __future__ import annotations

import argparse
import ctypes
import random
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np

import clrt
from clrt.live.live import Live
from clrt.scene.editing import materials_of, with_material
from clrt.scene.lights import PointLight
from clrt.scene.materials.material_types import Dielectric, Diffuse, Material, MetallicRoughness, Mirror
from clrt.scene.materials.presets import Preset
from clrt.scene.model import Scene, Sphere
from clrt.scene.render_settings import Integrator

GROWTH = 1.05
SIZE = (192, 144)
LAMP = PointLight(position=(0.0, 1.0, 1.0), intensity=(1.0, 1.0, 1.0))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene")
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--device")
    given = parser.parse_args()
    scene = clrt.load(given.scene)
    scene = replace(
        scene,
        render=replace(scene.render, size=SIZE, spp=64),
        spheres=scene.spheres or [Sphere(radius=0.2)],
        environment=replace(scene.environment, color=(0.1, 0.1, 0.1)),
        lights=scene.lights or [LAMP],
    )
    with Live(scene, device=given.device) as live:
        soak = Soak(live, random.Random(given.seed))
        memory = soak.run(60 * given.minutes)
    print(f"{soak.edits} edits, {dict(soak.kinds)}")
    print(
        f"{soak.pictures} pictures, {soak.programs} changes of program; seconds from edit to picture: "
        f"median {np.median(soak.latencies):.3f}, 99 % {np.percentile(soak.latencies, 99):.3f}"
    )
    # Caches fill in the first third; growth after it is a leak.
    settled, last = (np.median(np.array(part), axis=0) for part in np.array_split(memory, 3)[1:])
    for name, before, after in zip(("process", "process in use", "device"), settled, last):
        print(f"memory of the {name} in the second third {before / 2**20:.1f} MiB, in the last {after / 2**20:.1f} MiB")
    for problem in soak.problems:
        print(problem)
    return int(bool(soak.problems) or bool(np.any(last > GROWTH * settled)))


class Soak:
    """Random edits and the problems found."""

    def __init__(self, live: Live, random: random.Random) -> None:
        self.live, self.random = live, random
        self.kinds: Counter[str] = Counter()
        self.problems: list[str] = []
        self.latencies: list[float] = []
        self.edits = self.programs = self.pictures = 0
        self._edits: list[Callable[[], None]] = [
            self.walk,
            self.material,
            self.preset,
            self.move_sphere,
            self.add_sphere,
            self.remove_sphere,
            self.light,
            self.sky,
            self.integrator,
            self.settings,
            self.undo,
            self.redo,
            self.mistake,
        ]

    def run(self, seconds: float) -> list[tuple[int, int, int]]:
        """Edit for `seconds`; return process memory, heap memory in use and device memory after each edit."""
        end, memory, told = time.monotonic() + seconds, [], 0.0
        while time.monotonic() < end:
            edit = self.random.choice(self._edits)
            self.kinds[edit.__name__] += 1
            self.edits += 1
            start = time.perf_counter()
            edit()
            if edit is not self.mistake:
                wait = self.random.choice((0.0, 0.05, 0.3, 1.0))
                seen = self.live.wait(lambda now: now.asked == self.live.asked, 60)
                if seen.asked != self.live.asked:
                    self.problems.append(f"{edit.__name__}: no picture in a minute")
                if seen.error:
                    self.problems.append(f"{edit.__name__}: {seen.error}")
                self.latencies.append(time.perf_counter() - start)
                time.sleep(wait)
            memory.append((process_memory(), memory_in_use(), device_memory()))
            if time.monotonic() > told + 30:
                told, seen = time.monotonic(), self.live.snapshot()
                print(
                    f"{end - told:6.0f} s to go, {self.edits} edits, {memory[-1][0] / 2**20:.1f} MiB, "
                    f"programs {seen.programs}",
                    flush=True,
                )
        self.programs, self.pictures = self.live.snapshot().programs, self.live.snapshot().number
        return memory

    def walk(self) -> None:
        """Move the camera ten steps."""
        for _ in range(10):
            camera = self.live.scene.camera
            x, y, z = (value + self.random.gauss(0, 0.01) for value in camera.position)
            there = replace(camera, position=(x, y, z))
            self.live.edit(replace(self.live.scene, camera=there), moving=True, step=False)
            time.sleep(self.random.uniform(0, 0.05))

    def material(self) -> None:
        """Change the color of a material."""
        old = self._material()
        if isinstance(old, Diffuse | MetallicRoughness | Mirror | Dielectric):
            self._edit(with_material(self.live.scene, old, replace(old, color=self._color(1))))

    def preset(self) -> None:
        """Change the material type or preset of the first sphere."""
        substance = self.random.choice(get_args(Preset))
        new = self.random.choice(
            [
                Diffuse(),
                Mirror(),
                Dielectric(ior=self.random.uniform(1.1, 2)),
                MetallicRoughness(preset=substance, roughness=self.random.random()),
            ]
        )
        first, *others = self.live.scene.spheres
        self._edit(replace(self.live.scene, spheres=[replace(first, material=new), *others]))

    def move_sphere(self) -> None:
        """Move a sphere, as with a mouse."""
        spheres = list(self.live.scene.spheres)
        if spheres:
            i = self.random.randrange(len(spheres))
            for _ in range(5):
                spheres[i] = replace(spheres[i], center=self._point(), radius=self.random.uniform(0.05, 0.5))
                self._edit(replace(self.live.scene, spheres=list(spheres)), moving=True)

    def add_sphere(self) -> None:
        """Add a sphere, up to twelve."""
        ball = Sphere(center=self._point(), radius=0.1, material=self.live.scene.spheres[0].material)
        if len(self.live.scene.spheres) < 12:
            self._edit(replace(self.live.scene, spheres=[*self.live.scene.spheres, ball]))

    def remove_sphere(self) -> None:
        """Remove the last sphere, but never the first."""
        self._edit(replace(self.live.scene, spheres=self.live.scene.spheres[:1] + self.live.scene.spheres[1:-1]))

    def light(self) -> None:
        """Add a point light, and drop some of the others."""
        lights = [each for each in self.live.scene.lights if self.random.random() < 0.7][:5]
        lamp = PointLight(position=self._point(), intensity=self._color(5))
        self._edit(replace(self.live.scene, lights=[*lights, lamp]))

    def sky(self) -> None:
        """Change the strength, rotation and color of the environment."""
        sky = replace(
            self.live.scene.environment,
            strength=self.random.uniform(0.1, 2),
            color=self._color(1),
            rotation_degrees=self.random.uniform(0, 360),
        )
        self._edit(replace(self.live.scene, environment=sky))

    def integrator(self) -> None:
        """Change the integrator and the path depth."""
        names: list[Integrator] = ["path", "path", "direct", "local", "raster"]
        name = self.random.choice(names)
        render = replace(self.live.scene.render, integrator=name, max_depth=self.random.randint(1, 12))
        self._edit(replace(self.live.scene, render=render))

    def settings(self) -> None:
        """Change the BVH use, image scale and samples per frame."""
        self.live.choose(
            replace(
                self.live.settings,
                tree=self.random.choice((None, True)),
                scale=self.random.choice((1.0, 0.5)),
                samples=self.random.choice((1, 2)),
            )
        )

    def undo(self) -> None:
        """Undo the last step."""
        self.live.undo()

    def redo(self) -> None:
        """Redo the last undone step."""
        self.live.redo()

    def mistake(self) -> None:
        """An invalid edit must report an error and keep the last image."""
        right, shown = self.live.scene, self.live.snapshot().number
        self.live.edit(replace(right, camera=replace(right.camera, fov_degrees=200)), step=False)
        seen = self.live.wait(lambda now: now.asked == self.live.asked, 60)
        if not (seen.error and "fov_degrees" in seen.error and seen.number >= shown):
            self.problems.append(f"a mistake was not found: {seen.error}")
        self.live.edit(right, step=False)

    def _edit(self, scene: Scene, moving: bool = False) -> None:
        self.live.edit(scene, moving=moving)

    def _material(self) -> Material:
        return self.random.choice(list(materials_of(self.live.scene).values()))

    def _point(self) -> tuple[float, float, float]:
        return self.random.uniform(-1, 1), self.random.uniform(0, 1), self.random.uniform(-1, 1)

    def _color(self, scale: float) -> tuple[float, float, float]:
        return scale * self.random.random(), scale * self.random.random(), scale * self.random.random()


def process_memory() -> int:
    """Return the resident memory of this process in bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096


class Mallinfo(ctypes.Structure):
    """struct mallinfo2, mallinfo(3)."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in (
            "arena",
            "ordblks",
            "smblks",
            "hblks",
            "hblkhd",
            "usmblks",
            "fsmblks",
            "uordblks",
            "fordblks",
            "keepcost",
        )
    ]


def memory_in_use() -> int:
    """Return the heap bytes that are allocated and not freed."""
    libc = ctypes.CDLL("libc.so.6")
    libc.mallinfo2.restype = Mallinfo
    told = libc.mallinfo2()
    return int(told.uordblks + told.hblkhd)


def device_memory() -> int:
    """Return the used memory of NVIDIA devices in bytes; 0 without any."""
    if not shutil.which("nvidia-smi"):
        return 0
    asked = ["nvidia-smi", "--query-gpu=memory.used", "--format=csv,noheader,nounits"]
    return sum(int(line) for line in subprocess.run(asked, capture_output=True, text=True).stdout.split()) << 20


if __name__ == "__main__":
    sys.exit(main())
