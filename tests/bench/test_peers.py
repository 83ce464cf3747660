"""Embree's record layout is correct, all libraries agree with clrt, and missing ones are reported without an error."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.util import find_spec
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import clrt
from clrt.bench.interleaved import Contestant, race
from clrt.bench.rays.embree import EmbreeRays, EmbreeScene
from clrt.bench.rays.library_speed import agreement
from clrt.bench.rays.ray_libraries import LIBRARIES
from clrt.bench.rays.ray_speed import Rays
from clrt.bench.rays.workloads import bumpy_ball, closed_room
from clrt.device.open import Device

from ..rendering.rays import hit_triangles

pytestmark = pytest.mark.needs("embreex")
RNG = np.random.default_rng(17)
BALL = bumpy_ball(3)
#: Number of rays that is no multiple of the packet, chunk and block sizes.
COUNT = 4096 + 128 + 13
MODULES = {
    "embreex": "embreex",
    "trimesh + embreex": "embreex",
    "trimesh + rtree": "rtree",
    "open3d": "open3d",
    "warp": "warp",
}


def rays(count: int = COUNT) -> Rays:
    """Return rays from around the sphere: a third of them misses; every other one has a t_max near its hit."""
    origins = RNG.uniform(-2, 2, (count, 3)).astype(np.float32)
    directions = RNG.normal(size=(count, 3)).astype(np.float32) - origins
    t_max = np.where(np.arange(count) % 2, np.inf, RNG.uniform(0, 2, count)).astype(np.float32)
    return origins, directions, t_max


def brute_force(some: Rays) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.bool_]]:
    """Return float64 t (inf: miss), triangle (−1: miss), and whether the result is insensitive to rounding."""
    corners = BALL[0][BALL[1]].astype(np.float64)
    parts = zip(*(np.array_split(array.astype(np.float64), 20) for array in some[:2]))
    t, triangle, margin = map(np.concatenate, zip(*(hit_triangles(corners, *part) for part in parts if len(part[0]))))
    at_the_end = np.isfinite(t) & np.isclose(t, some[2], rtol=1e-4)
    return np.where(t < some[2], t, np.inf), np.where(t < some[2], triangle, -1), (margin > 1e-4) & ~at_the_end


@pytest.mark.needs("cc")
@pytest.mark.parametrize("count", [COUNT, 3])
def test_embree_finds_what_brute_force_finds(count: int) -> None:
    """Holds in all modes, for all rays including the last packet, and when they are traced again."""
    some = rays(count)
    t, triangle, clear = brute_force(some)
    assert clear.mean() > 0.9
    for robust in (False, True):
        scene = EmbreeScene(*BALL, robust=robust)
        assert scene.build_seconds > 0 and scene.bytes > len(BALL[1]) * 36
        for width, coherent in product((1, 8), (False, True)):
            closest = EmbreeRays(scene, some, any_hit=False, width=width, coherent=coherent)
            blocked = EmbreeRays(scene, some, any_hit=True, width=width, coherent=coherent)
            for _ in range(2):
                closest.t[:], closest.primitive[:], blocked.t[:] = 0, 0, 0
                assert min(*closest.trace(), *blocked.trace()) > 0
                np.testing.assert_array_equal(closest.primitive[clear], triangle[clear])
                np.testing.assert_allclose(closest.t[clear], np.minimum(t, some[2])[clear], rtol=1e-4)
                np.testing.assert_array_equal((blocked.t == -np.inf)[clear], (triangle >= 0)[clear])
        scene.close()


@pytest.mark.parametrize("name", [name for name, module in MODULES.items() if find_spec(module)])
def test_installed_libraries_agree_with_brute_force(name: str) -> None:
    origins, directions, _ = rays(1000)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    t, triangle, clear = brute_force((origins, directions, np.full(1000, np.inf, np.float32)))
    assert 0.2 < np.mean(triangle >= 0) < 0.95
    primitives, ts = LIBRARIES[name].prepare(*BALL)(origins, directions)
    np.testing.assert_array_equal(primitives[clear], triangle[clear])
    if ts is not None:
        hit = clear & (triangle >= 0)
        np.testing.assert_allclose(ts[hit], t[hit], rtol=1e-4)


def test_every_library_is_known() -> None:
    assert set(MODULES) == set(LIBRARIES)


def test_agreement_counts_rays_not_edges(device: Device) -> None:
    """Hits at the same t agree even if the triangle is a neighbor; other t and misses do not agree."""
    some = rays(100)
    ours = clrt.RayQuery(*closed_room(*BALL), device=device.info.index).closest_hit(some[0], some[1])
    primitive, t = ours["primitive"].copy(), ours["t"].copy()
    primitive[:10] += 1
    assert agreement(ours, primitive, t) == 1.0
    assert agreement(ours, primitive, None) == 0.9
    t[10:30] *= 1.01
    assert agreement(ours, primitive, t) == 0.8
    primitive[:40] = -1
    assert agreement(ours, primitive, t) == 0.6


def test_race_takes_turns_and_medians() -> None:
    order = []

    def runner(name: str, seconds: list[float]) -> Contestant:
        def run() -> tuple[float, float]:
            order.append(name)
            value = seconds.pop()
            return value, 2 * value

        return Contestant(run, 1000 if name == "a" else 500, 0.25)

    result = race({"a": runner("a", [9.0, 1.0, 2.0]), "b": runner("b", [1.5, 0.5, 100.0])}, rounds=3)
    assert order == ["a", "b"] * 3
    assert result["a"] == {
        "rays": 1000,
        "seconds": 2,
        "cpu_seconds": 4,
        "mrays": pytest.approx(0.0005),
        "ratio": 1,
        "cpu_ratio": 1,
        "agrees": 0.25,
        "rounds": [(2, 4), (1, 2), (9, 18)],
    }
    assert result["b"]["ratio"] == pytest.approx((1000 / 2) / (500 / 1.5))


@pytest.mark.parametrize("blocked", [(), ("embreex", "open3d", "warp", "rtree")], ids=["all", "nothing installed"])
def test_command_prints_ratios_and_what_is_missing(blocked: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "corner.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    program = f"""
import sys
sys.modules.update(dict.fromkeys({blocked!r}))
from clrt.cli import main
main(["bench", "peers", "--mesh", "corner.obj", "--quick", "--json", "peers.json"])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (scene,) = json.loads((tmp_path / "peers.json").read_text())["scenes"]
    assert scene["triangles"] == 4 + 12 and list(scene["kernels"]) == ["primary", "bounce", "shadow", "occluded"]
    if blocked:
        assert set(scene["missing"]) == {"embree", *LIBRARIES} and list(scene["calls"]["primary"]) == ["clrt"]
        assert all(f"(pip install {package})" in done.stdout for package in ("embreex", "open3d", "warp-lang", "rtree"))
    else:
        contestants = [each for kind in (scene["kernels"] | scene["calls"]).values() for each in kind.values()]
        assert min(each["agrees"] for each in contestants) > 0.999
        assert min(each["ratio"] for each in contestants) > 0
        assert not {"embree", "embreex", "trimesh + rtree"} & set(scene["missing"])
