"""Ray origins are offset beyond the rounding error: a ray never hits the surface that it leaves, at any position."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.bench.kernel_probe import Probe
from clrt.device.open import Device
from clrt.scene.model import Mesh, Scene, Sphere

from ..covering import covering

Doubles = NDArray[np.float64]
COUNT = 1_000_000
OFFSETS = (0.0, 1e3, 1e6)


def opposite(offset: float) -> list[Sphere]:
    """Return spheres that keep the scene's centre, and so the device's origin, far from what is at `offset`."""
    return [Sphere(center=(-offset, -offset, -offset), radius=0.5)] if offset else []


def unit(count: int, seed: int) -> Doubles:
    w = np.random.default_rng(seed).normal(size=(count, 3))
    return np.asarray(w / np.linalg.norm(w, axis=1, keepdims=True))


def leaving(normal: Doubles, seed: int) -> Doubles:
    """Return directions above the surfaces, a tenth of them within a thousandth of grazing."""
    w = unit(len(normal), seed)
    w[::10] -= 0.999 * np.sum(w[::10] * normal[::10], axis=1, keepdims=True) * normal[::10]
    w *= np.sign(np.sum(w * normal, axis=1, keepdims=True))
    return np.asarray(w / np.linalg.norm(w, axis=1, keepdims=True))


def rays_to(points: Doubles, normal: Doubles, distance: float) -> tuple[Doubles, Doubles]:
    """Return origins in front of points, and directions towards them."""
    origin = (points + distance * leaving(normal, 1)).astype(np.float32).astype(np.float64)
    return origin, points - origin


@pytest.mark.programs
@covering("axis, offset", [(0.5, 0.7, -0.3), (0.0, 1.0, 0.0)], OFFSETS)
def test_plane(device: Device, offset: float, axis: tuple[float, float, float]) -> None:
    """One large triangle, offset on all axes, with rays on both sides."""
    n = np.array(axis) / np.linalg.norm(axis)
    s = np.cross(n, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(n, [0.0, 0.0, 1.0]))
    corners = (offset + 100 * np.array([s, np.cross(n, s), -s - np.cross(n, s)])).astype(np.float32)
    exact = np.cross(*(corners[1:].astype(np.float64) - corners[0]))
    exact /= np.linalg.norm(exact)
    b = np.random.default_rng(0).dirichlet([1, 1, 1], COUNT)
    side = np.where(np.arange(COUNT) % 2, 1.0, -1.0)[:, None] * exact
    origin, direction = rays_to(b @ corners.astype(np.float64), side, 50.0)
    probe = Probe(device, Scene(meshes=[Mesh(corners, np.array([[0, 1, 2]], np.int32))], spheres=opposite(offset)))
    out = departures(probe, origin, direction, leaving(side, 2))
    assert np.count_nonzero(np.isfinite(out[:, 13]) & (out[:, 0] >= 0)) == 0
    check_error_bound(out, np.abs((out[:, 1:4] - corners[0]) @ exact), exact)


@covering("radius, offset", [1.0, 1000.0], OFFSETS)
def test_sphere(device: Device, offset: float, radius: float) -> None:
    center = np.float32(offset) * np.ones(3)
    n = unit(COUNT, 0)
    origin, direction = rays_to(center + radius * n, n, 3 * radius)
    probe = Probe(device, Scene(spheres=[Sphere(center=(offset, offset, offset), radius=radius), *opposite(offset)]))
    w = leaving(n, 2)
    out = departures(probe, origin, direction, w)
    # Far away float32 blurs hit points: keep only the rays that are certain to leave the upper side there.
    above = np.sum(out[:, 7:10] * w, axis=1) > 1e-6
    assert np.count_nonzero(np.isfinite(out[above, 13])) == 0
    check_error_bound(out, np.abs(np.linalg.norm(out[:, 1:4] - center, axis=1) - radius), out[:, 7:10])


def plane_departures(device: Device, offset: str, shift: float, size: float) -> tuple[Doubles, Doubles, float]:
    """Return probe_leave's output for a tilted triangle of about `size`, `shift` from the origin; its sides; the
    unit."""
    n = np.array([0.5, 0.7, -0.3]) / np.linalg.norm([0.5, 0.7, -0.3])
    s = np.cross(n, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(n, [0.0, 0.0, 1.0]))
    corners = (shift + size * np.array([s, np.cross(n, s), -s - np.cross(n, s)])).astype(np.float32)
    scene = Scene(meshes=[Mesh(corners, np.array([[0, 1, 2]], np.int32))], spheres=opposite(shift))
    probe = Probe(device, scene, offset=offset)
    exact = np.cross(*(corners[1:].astype(np.float64) - corners[0]))
    side = np.where(np.arange(20_000) % 2, 1.0, -1.0)[:, None] * exact / np.linalg.norm(exact)
    points = np.random.default_rng(0).dirichlet([1, 1, 1], len(side)) @ corners.astype(np.float64)
    origin, direction = rays_to(points, side, size / 2)
    scale = probe.compiled.frame.unit
    return departures(probe, scale * origin, direction, leaving(side, 2)), side, scale


@pytest.mark.programs
@covering("offset, shift", ["fixed", "ulp", "bound"], OFFSETS[::-1])
def test_far_away_a_fixed_distance_is_not_enough(device: Device, offset: str, shift: float) -> None:
    """At 10^6 an ulp is 0.06: with an offset of a thousandth many rays hit the plane that they leave."""
    out, side, _ = plane_departures(device, offset, shift, 100.0)
    hit = out[:, 0] >= 0
    met = np.mean(np.isfinite(out[hit, 13]))
    if offset == "fixed" and shift == 1e6:
        assert met > 0.1
        return
    assert met == 0
    if shift == 0:  # with coordinates small enough to tell, origins are on the side that rays leave to
        assert np.all(np.sum((out[:, 10:13] - out[:, 1:4]) * side, axis=1)[hit] > 0)


@pytest.mark.programs
@pytest.mark.parametrize("size", [1.0, 2.0**-40])
@pytest.mark.parametrize("offset, distance", [("fixed", 1e-3), ("ulp", 2.0**-16)])
def test_lengths_of_offsets_are_those_of_the_scene(device: Device, offset: str, distance: float, size: float) -> None:
    """They do not depend on the unit used for tracing. Ulps: within 2^-5 of the origin, where the distance is fixed."""
    out, side, unit = plane_departures(device, offset, 0.0, size)
    near = (out[:, 0] >= 0) & (np.abs(out[:, 1:4]).max(axis=1) < unit / 32)
    assert near.sum() > 10 and (unit == 1) == (size == 1)
    moved = out[near, 10:13].astype(np.float64) - out[near, 1:4]
    np.testing.assert_allclose(moved, distance * unit * side[near], rtol=1e-3, atol=1e-7 * size * unit)


def departures(probe: Probe, origin: Doubles, direction: Doubles, leave: Doubles) -> Doubles:
    """Return probe_leave's output for the rays that hit, which are all except for some grazing ones."""
    out = probe("leave", 14, origin, direction, leave)
    assert np.mean(out[:, 0] >= 0) > 0.9
    return out


def check_error_bound(out: Doubles, distance: Doubles, normal: Doubles) -> None:
    """Assert that positions are no farther from the true surface than the error they report."""
    hit = out[:, 0] >= 0
    assert np.all(distance[hit] <= np.sum(out[:, 4:7] * np.abs(normal), axis=1)[hit])
