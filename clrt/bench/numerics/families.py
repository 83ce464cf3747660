"""Alternative intersection tests compared: their speed and their errors.

Speeds are measured in interleaved runs, errors by the hard cases of `cases`. In each family the first is the default.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ...rendering.renderer import Renderer
from ...scene.model import RenderSettings
from ..interleaved import Contestant, race
from ..rays.hard_meshes import soup
from ..rays.ray_speed import Rays, Run, scattered_rays
from ..rays.workloads import bumpy_ball, closed_room, workloads
from .cases.axes import measure_axes
from .cases.departures import lit_scenes, measure_departures
from .cases.distances import ANGLES_DEGREES, DISTANCES, distances
from .cases.spheres import measure_spheres
from .cases.subject import Subject, endless, ulps, unit_vectors
from .cases.watertight import measure_watertight
from .exact_hits import UNDECIDED, closest_bounds
from .row import Row

#: Tests of each family.
FAMILIES = {
    "triangle": ("watertight", "moller_trumbore", "precomputed", "baldwin_weber"),
    "box": ("robust", "plain"),
    "sphere": ("robust", "textbook"),
    "offset": ("bound", "ulp", "fixed"),
}
#: Errors of each family: keys and descriptions; the first is the primary criterion.
FIGURES = {
    "triangle": {
        "misses": "misses/M",
        "misses_moved": "misses/M moved",
        "wrong": "wrong hits/M",
        "ulp_max": "t ulp max",
        "ulp_999": "t ulp 99.9 %",
        "ulp_999_grazing": "grazing 99.9 %",
        "bytes": "bytes/triangle",
    },
    "box": {
        "misses": "misses/M",
        "misses_moved": "misses/M moved",
        "wrong": "wrong on axes/M",
        "lost": "lost on plane/M",
    },
    "sphere": {"wrong": "wrong hits/M", "ulp_max": "t ulp max"},
    "offset": {
        "wrong": "wrong pixels/M",
        "dark_near": "dark, in place",
        "dark_far": "dark, elsewhere",
        "lit_near": "leaks, in place",
        "lit_far": "leaks, elsewhere",
    },
}
LEAST_GRAZING_DEGREES = 85.0
BALLS = 2000
#: Rays from inside closed meshes per test.
RAYS = 4e6


def measure_families(device: int, *, quick: bool) -> Iterator[tuple[str, dict[str, dict[str, Any]]]]:
    """Yield each family's name, and for each of its tests the results of `race` and its errors (FIGURES)."""
    for family, names in FAMILIES.items():
        chosen: list[dict[str, Any]] = [{family: name} for name in names]
        subjects = {name: replace(Subject(device), **choice) for name, choice in zip(names, chosen)}
        speeds = race(dict(zip(names, RACES[family](list(subjects.values()), quick))))
        yield family, {name: speeds[name] | ERRORS[family](subject, quick) for name, subject in subjects.items()}


def _race_rays(subjects: list[Subject], quick: bool) -> Iterator[Contestant]:
    """Trace bounce rays in a closed room."""
    mesh = bumpy_ball(4 if quick else 7)
    room = closed_room(*mesh)
    size = (200, 200) if quick else (640, 640)
    kinds = workloads(*room, mesh[0], subjects[0].query(room).closest_hit, size)
    rays = next(kind.rays for kind in kinds if kind.name == "bounce")
    for subject in subjects:
        query = subject.query(room)
        yield Contestant(Run(query, query.closest_hit, rays), len(rays[2]))


def _race_balls(subjects: list[Subject], quick: bool) -> Iterator[Contestant]:
    """Trace rays in all directions from among many spheres."""
    rng, count = np.random.default_rng(0), 1 << (12 if quick else 19)
    balls = np.hstack([rng.uniform(-1, 1, (BALLS, 3)), rng.uniform(0.005, 0.03, (BALLS, 1))]).astype(np.float32)
    rays = endless(rng.uniform(-1, 1, (count, 3)), unit_vectors(rng, count))
    for subject in subjects:
        query = subject.query(spheres=balls)
        yield Contestant(Run(query, query.closest_hit, rays), count)


def _race_pictures(subjects: list[Subject], quick: bool) -> Iterator[Contestant]:
    """Render a corner of two walls under a directional light; `rays` counts samples."""
    size, samples = ((128, 128), 4) if quick else ((256, 256), 8)
    scene = lit_scenes(np.zeros(3), 1.0, level_only=False)["corner of two walls"]
    settings = RenderSettings(size=size, integrator="path", max_depth=6)
    for subject in subjects:
        renderer = Renderer(replace(scene, render=settings), device=subject.device, offset=subject.offset)

        def run(renderer: Renderer = renderer) -> tuple[float, float]:
            start, cpu = time.perf_counter(), time.process_time()
            for _ in renderer.session.render(samples):
                pass
            renderer.session.wait()
            return time.perf_counter() - start, time.process_time() - cpu

        run()
        yield Contestant(run, size[0] * size[1] * samples)


RACES: dict[str, Callable[[list[Subject], bool], Iterable[Contestant]]] = {
    "triangle": _race_rays,
    "box": _race_rays,
    "sphere": _race_balls,
    "offset": _race_pictures,
}


def _triangle_errors(subject: Subject, quick: bool) -> dict[str, Any]:
    """Measure errors of a triangle test.

    bytes: per triangle; misses: per million rays inside closed meshes; wrong: per million, by float64; ulp: of t.
    """
    rows = list(measure_watertight(subject, quick=quick, rays=RAYS))
    wrong, count = _wrong_hits(subject, quick)
    steep, grazing = _distance_errors(subject, quick)
    mesh = bumpy_ball(4)
    return {
        "bytes": subject.query(mesh).tree.bytes / len(mesh[1]),
        **_parts(rows),
        "wrong": 1e6 * wrong / count,
        "ulp_max": float(steep.max()),
        "ulp_999": float(np.quantile(steep, 0.999)),
        "ulp_999_grazing": float(np.quantile(grazing, 0.999)),
    }


def _box_errors(subject: Subject, quick: bool) -> dict[str, Any]:
    """Measure errors of a box test.

    misses: as for triangles; wrong: per million axis-parallel rays, by float64; lost: per million rays at a plane.
    """
    rows = list(measure_axes(subject, quick=quick))
    return {
        **_parts(measure_watertight(subject, quick=quick, rays=RAYS)),
        "wrong": _a_million(row for row in rows if row.case == "G6"),
        "lost": _a_million(row for row in rows if row.case == "G7"),
    }


def _sphere_errors(subject: Subject, quick: bool) -> dict[str, Any]:
    """Measure errors of a sphere test.

    wrong: per million rays that certainly hit or certainly miss; ulp: of t, for hits that are not grazing.
    """
    rows = list(measure_spheres(subject, quick=quick))
    steep = [row.figure for row in rows if row.what.endswith("steep, largest") and row.figure is not None]
    return {"wrong": _a_million(row for row in rows if row.unit == ""), "ulp_max": max(steep)}


def _offset_errors(subject: Subject, quick: bool) -> dict[str, Any]:
    """Measure errors of a ray origin offset.

    dark, lit: wrong pixels per million, with the scene in place (near) and transformed (far); wrong: over all.
    """
    rows = list(measure_departures(subject, quick=quick))
    near = [row for row in rows if "in its place" in row.what]
    far = [row for row in rows if row not in near]
    parts = {
        f"{wrong}_{name}": _a_million(row for row in some if row.what.endswith(wrong))
        for name, some in (("near", near), ("far", far))
        for wrong in ("dark", "lit")
    }
    return {"wrong": _a_million(rows), **parts}


ERRORS = {"triangle": _triangle_errors, "box": _box_errors, "sphere": _sphere_errors, "offset": _offset_errors}


def _parts(rows: Iterable[Row]) -> dict[str, float]:
    """Return misses per million rays; misses_moved: the same with the mesh transformed."""
    rows = list(rows)
    home = [row for row in rows if row.what.endswith("in its place")]
    return {"misses": _a_million(home), "misses_moved": _a_million(row for row in rows if row not in home)}


def _a_million(rows: Iterable[Row]) -> float:
    rows = list(rows)
    return 1e6 * sum(row.wrong for row in rows) / sum(row.count for row in rows)


def _wrong_hits(subject: Subject, quick: bool) -> tuple[int, int]:
    """Count hits of random rays that float64 rules out, and rays for which float64 finds a single possible result."""
    wrong = count = 0
    for mesh in (bumpy_ball(3), soup(400)):
        rays: Rays = scattered_rays(mesh[0], 1 << (10 if quick else 18))
        bounds = closest_bounds(*mesh, rays)
        wrong += int(np.count_nonzero(bounds.wrong(rays, subject.query(mesh).closest_hit(*rays))))
        count += int(np.count_nonzero(bounds.primitive != UNDECIDED))
    return wrong, count


def _distance_errors(subject: Subject, quick: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return errors of t in ulps over all distances, for steep and for grazing rays."""
    errors: tuple[list[np.ndarray], list[np.ndarray]] = [], []
    for distance in DISTANCES:
        for angle in ANGLES_DEGREES:
            t, exact, _ = distances(subject, distance, angle, 1 << (9 if quick else 14))
            found = np.isfinite(t)
            errors[angle >= LEAST_GRAZING_DEGREES].append(ulps(t[found], exact[found]))
    return np.concatenate(errors[0]), np.concatenate(errors[1])
