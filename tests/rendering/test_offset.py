"""Rays that leave a surface start outside its rounding: they never meet that surface again, wherever it lies."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clrt.device.open import Device
from clrt.scene.model import Mesh, Scene, Sphere

from ..probe import Probe

Doubles = NDArray[np.float64]
COUNT = 1_000_000
OFFSETS = (0.0, 1e3, 1e6)


def unit(count: int, seed: int) -> Doubles:
    w = np.random.default_rng(seed).normal(size=(count, 3))
    return np.asarray(w / np.linalg.norm(w, axis=1, keepdims=True))


def leaving(normal: Doubles, seed: int) -> Doubles:
    """Directions above the surfaces, a tenth of them within a thousandth of grazing."""
    w = unit(len(normal), seed)
    w[::10] -= 0.999 * np.sum(w[::10] * normal[::10], axis=1, keepdims=True) * normal[::10]
    w *= np.sign(np.sum(w * normal, axis=1, keepdims=True))
    return np.asarray(w / np.linalg.norm(w, axis=1, keepdims=True))


def rays_to(points: Doubles, normal: Doubles, distance: float) -> tuple[Doubles, Doubles]:
    """Origins in front of points, and directions towards them."""
    origin = (points + distance * leaving(normal, 1)).astype(np.float32).astype(np.float64)
    return origin, points - origin


@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("axis", [(0.0, 1.0, 0.0), (0.5, 0.7, -0.3)], ids=["level", "tilted"])
def test_plane(device: Device, offset: float, axis: tuple[float, float, float]) -> None:
    """One large triangle, far away on all axes, lit from both sides."""
    n = np.array(axis) / np.linalg.norm(axis)
    s = np.cross(n, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(n, [0.0, 0.0, 1.0]))
    corners = (offset + 100 * np.array([s, np.cross(n, s), -s - np.cross(n, s)])).astype(np.float32)
    exact = np.cross(*(corners[1:].astype(np.float64) - corners[0]))
    exact /= np.linalg.norm(exact)
    b = np.random.default_rng(0).dirichlet([1, 1, 1], COUNT)
    side = np.where(np.arange(COUNT) % 2, 1.0, -1.0)[:, None] * exact
    origin, direction = rays_to(b @ corners.astype(np.float64), side, 50.0)
    probe = Probe(device, Scene(meshes=[Mesh(corners, np.array([[0, 1, 2]], np.int32))]))
    out = departures(probe, origin, direction, leaving(side, 2))
    assert np.count_nonzero(np.isfinite(out[:, 13]) & (out[:, 0] >= 0)) == 0
    check_error_bound(out, np.abs((out[:, 1:4] - corners[0]) @ exact), exact)


@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("radius", [1.0, 1000.0])
def test_sphere(device: Device, offset: float, radius: float) -> None:
    center = np.float32(offset) * np.ones(3)
    n = unit(COUNT, 0)
    origin, direction = rays_to(center + radius * n, n, 3 * radius)
    probe = Probe(device, Scene(spheres=[Sphere(center=(offset, offset, offset), radius=radius)]))
    w = leaving(n, 2)
    out = departures(probe, origin, direction, w)
    # Far away float32 blurs where a ray meets the sphere: keep the rays that leave its upper side there, too, for sure.
    above = np.sum(out[:, 7:10] * w, axis=1) > 1e-6
    assert np.count_nonzero(np.isfinite(out[above, 13])) == 0
    check_error_bound(out, np.abs(np.linalg.norm(out[:, 1:4] - center, axis=1) - radius), out[:, 7:10])


def departures(probe: Probe, origin: Doubles, direction: Doubles, leave: Doubles) -> Doubles:
    """What probe_leave gives for the rays that hit, which are all but some grazing ones."""
    out = probe("leave", 14, origin, direction, leave)
    assert np.mean(out[:, 0] >= 0) > 0.9
    return out


def check_error_bound(out: Doubles, distance: Doubles, normal: Doubles) -> None:
    """A position is no farther from the true surface than the error it states."""
    hit = out[:, 0] >= 0
    assert np.all(distance[hit] <= np.sum(out[:, 4:7] * np.abs(normal), axis=1)[hit])
